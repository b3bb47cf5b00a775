// Makes batches for the graphics card: one for each tile, with positions relative to the batch's own origin. Single
// precision is then enough at any distance from the world's origin. Pure functions; any thread.
#pragma once

#include "index/set/tile_store.h"
#include "viewer/scene/colour.h"
#include "viewer/scene/drawn_somata.h"

#include <cstdint>
#include <map>
#include <string>
#include <vector>

namespace filiform {

enum class ColourBy : std::uint8_t { cell, type, depth, radius, tile };
inline constexpr ColourBy kColourings[] = {ColourBy::cell, ColourBy::type, ColourBy::depth, ColourBy::radius,
                                           ColourBy::tile};
const char* toString(ColourBy colouring) noexcept;
std::optional<ColourBy> colouringNamed(const std::string& name);

struct DrawnSegment {  // a round cone: child end a, parent end b; a sphere if they coincide
  float a_um[3], a_radius_um;
  float b_um[3], b_radius_um;
  std::uint32_t paint;  // of a neurite ownerPaint(): a palette has its colour (cell_palette.h); else paintOf(colour)
};
static_assert(sizeof(DrawnSegment) == 36);

// A cell and the kind of an SWC type: 1 to 4 as in the file, 0 for all others. Cells from 2^29 on share numbers.
constexpr std::uint32_t kCellBits = 29;
constexpr std::uint32_t ownerPaint(std::uint32_t cell, std::uint16_t type) {
  return (cell & ((1U << kCellBits) - 1)) | (type <= 4 ? std::uint32_t{type} : 0U) << kCellBits;
}
constexpr std::uint32_t cellOfPaint(std::uint32_t paint) { return paint & ((1U << kCellBits) - 1); }
constexpr std::uint16_t typeOfPaint(std::uint32_t paint) { return static_cast<std::uint16_t>(paint >> kCellBits); }

// One of 255 numbers, not 255: halos of a segment spare segments of the same mark. Overlays have 255.
constexpr std::uint8_t markOfCell(std::uint32_t cell) {
  return static_cast<std::uint8_t>((cell * 2654435761U >> 16) % 255);
}

struct NeuriteBatch {
  Vector3d origin_W = Vector3d::Zero();  // a_um and b_um are relative to it
  Vector3d lo_W = Vector3d::Zero(), hi_W = Vector3d::Zero();
  float largest_radius_um = 0;
  double pixel_um = 0;   // of a level tile: hidden segments share pixels of this size; lines are drawn as wide
  bool by_cell = false;  // segments have ownerPaint(), not colours
  TileId tile = 0;       // of ColourBy::tile
  std::vector<DrawnSegment> segments;
  // Parts of a large batch that lie together, one after the other: an eye inside the batch is inside few of them.
  // Empty: the batch is one part.
  struct Block {
    std::size_t end;      // of its segments
    Vector3d lo_W, hi_W;  // with their thickness
  };
  std::vector<Block> blocks;
  std::uint64_t implausible_radii = 0;  // replaced ones; see drawnRadius()
};

// The radius that is drawn. Some files give radii in another unit, and nearly all have unknown ones. A radius from
// kThinnest_um to kThickest_um (soma: kThickestSoma_um) is plausible and used. Any other is replaced by
// kDrawnUnknown_um (soma: kDrawnUnknownSoma_um), and `*replaced` is set to true.
inline constexpr float kThinnest_um = 0.01F, kThickest_um = 10, kThickestSoma_um = 30;
inline constexpr float kDrawnUnknown_um = 0.3F, kDrawnUnknownSoma_um = 6;
float drawnRadius(float radius_um, std::uint16_t type, bool* replaced = nullptr) noexcept;

// Cells with an *open node* in the tile: one that is no segment's child end. It is a root, or a sample whose own
// segment is in another tile. Ascending. O(n log n).
std::vector<std::uint32_t> cellsWithOpenNodes(const Tile& tile);

struct BatchOptions {
  const RootTable* roots = nullptr;      // roots of type soma are drawn as spheres; others give first segments a radius
  const SomaTable* somata = nullptr;     // each is drawn as one sphere instead of the segments between its samples
  std::uint32_t only_cell = UINT32_MAX;  // if set: draw the segments of this cell only
};

// Makes the batch of all segments that the tile owns, except those inside somata. Isolated samples and somata become
// spheres. A segment's two radii are those of its samples. If another tile has the radius of the parent, the segment is
// as thick there as at the child. `appearance` must be the tile's. O(n).
NeuriteBatch makeBatch(const Tile& tile, const TileAppearance& appearance, const BatchOptions& options = {});

// Appends the segments of `more`, whose origin must be near the batch's own. O(more).
void append(NeuriteBatch& batch, const NeuriteBatch& more);

// A segment from a place to itself.
bool isBall(const DrawnSegment& segment) noexcept;

// Cuts a batch of more than `most_segments` into blocks of at most so many, by halves along the longest side.
// O(n log n).
inline constexpr std::size_t kBlockSegments = 2048;
void cutIntoBlocks(NeuriteBatch& batch, std::size_t most_segments = kBlockSegments);

// Sorts each block into the order that the renderer needs: balls, then the others, each by the larger radius, falling.
// Stable, O(n log n). The check is O(n).
void sortForDrawing(NeuriteBatch& batch);
bool isSortedForDrawing(const NeuriteBatch& batch);

}  // namespace filiform
