// Neurites as paths, for drawing: what level tiles are made of (levels/levels.h).
//
// A path is a polyline through samples of one cell. Simplifying a path removes samples within a stated error and moves
// none. Paths need not join: a branch begins at a sample that its carrier passes through. A path of one point is a
// ball: an isolated sample or a soma. Thread rule: values and functions without state.
#pragma once

#include "index/tile/tile.h"

#include <cstdint>
#include <span>
#include <vector>

namespace filiform {

// A point of a path. The other members describe the segment that ends here; for a path's first point only a ball's
// radius and type count.
struct NeuritePoint {
  GridPoint p;
  float radius_um = 0;         // mean of these segments; NaN where unknown
  std::uint16_t type = 0;      // of the sample
  std::uint32_t segments = 0;  // segments in full resolution that it represents
};

inline constexpr std::uint32_t kNoSample = UINT32_MAX;

struct NeuritePath {
  std::uint32_t cell = 0;
  std::uint32_t first_sample = kNoSample, last_sample = kNoSample;  // at its ends; kNoSample: the path was cut there
  std::uint32_t lowest = kNoSample;    // it passes through the samples lowest .. last_sample; kNoSample: not known
  std::uint32_t begin = 0, count = 0;  // its points
  bool attached = false;               // another path passes through its first point

  bool isBall() const { return count == 1; }
};

// What one block of the partition owns, simplified or not.
struct Neurites {
  std::vector<NeuritePath> paths;
  std::vector<NeuritePoint> points;
  double error_um = 0;            // largest distance between a point of the neurites in full resolution and their path
  double pixel_um = 0;            // hidden segments share pixels of this size with others; 0: none is hidden
  std::uint64_t represented = 0;  // segments in full resolution, isolated ones included
  std::uint64_t hidden = 0;       // the same, of segments that hide() removed
  double hidden_um = 0;           // their length, simplified
};

// The segments that a tile owns, in the order of their ids. O(n log n).
Neurites neuritesOf(std::span<const StoredSegment> segments, const TileAppearance& appearance);
Neurites neuritesOf(const Tile& tile, const TileAppearance& appearance);

// Appends the neurites of a neighbouring block. linked() then joins paths: a path continues where another ends.
// O(n + paths log paths).
void append(Neurites& all, const Neurites& part);
Neurites linked(Neurites all);
Neurites join(std::vector<Neurites> parts);  // both, for all parts

// Removes samples near the remaining path, and short attached paths. Adds at most `tolerance_um` to error_um: three
// quarters of it for paths, a quarter for the reach of attached paths from their first points. O(n) usually.
void simplify(Neurites& neurites, const Grid& grid, double tolerance_um);

// Hides segments whose pixels are covered by other segments of the block from each of 7 directions: along axes and
// diagonals of a cube. Pixels are squares of `pixel_um`. Every pixel that the neurites cover from
// one of these directions stays covered. Long paths are kept first. `every_cell`: balls stay, and the longest
// segment of each cell. `bounds`: as for cutOut(). O(segments * pixels of a segment).
void hide(Neurites& neurites, const Grid& grid, double pixel_um, bool every_cell = true,
          std::span<std::size_t> bounds = {});

// Removes balls, and the segments that end at a point, where `kept` is 0. The paths fall into pieces. `bounds`:
// ascending places among the paths; each becomes the place of what is left of the paths from there on.
void cutOut(Neurites& neurites, std::span<const std::uint8_t> kept, std::span<std::size_t> bounds = {});

// The segments of a tile. Samples are numbered along the paths, anew for each cell. Fills `appearance` in the same
// order.
std::vector<StoredSegment> numbered(const Neurites& neurites, TileAppearance& appearance);

// The bytes of neurites for temporary files, and back.
std::vector<std::uint8_t> packed(const Neurites& neurites);
Neurites unpacked(std::span<const std::uint8_t> bytes);

}  // namespace filiform
