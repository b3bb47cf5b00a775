// A few points that stand for the whole data set: a search tree over them bounds any nearest-segment search without
// touching the disk, and alone answers it with a stated error.
//
// Space is cut into equal cells (of one depth of the partition), as fine as the number of points allows; the middle of
// a segment that is nearest to the middle of its cell stands for all segments whose middles are in the cell. Segments
// longer than a cell get points of their own along them. So everything can be found leaf by leaf, in any order.
#pragma once

#include "index/tile_store.h"

#include <array>
#include <map>
#include <span>

namespace filiform {

inline constexpr std::size_t kMaxSamplePoints = 65536;

// How many points a set of so many segments gets: one for 128 segments, at least 64. A set of few tiles hardly needs
// any.
std::size_t samplePointsFor(std::uint64_t segments);

// What the spacing of the points follows from. Thread-compatible.
class SampleSurvey {
 public:
  // All segments, in any order.
  void addLength(const GridPoint& a, const GridPoint& b);
  // Keys of all midpoints, ascending, in one piece or several that follow each other.
  void addKeys(std::span<const MortonKey> sorted);
  // Both, of a survey of what follows.
  void add(const SampleSurvey& next);
  std::uint64_t keys() const { return keys_; }

 private:
  friend class SampleChooser;
  void join(MortonKey next);
  std::array<std::uint64_t, kMortonAxisBits + 3> longer_{};  // by e: lengths in (2^(e-1), 2^e] quanta
  std::array<std::uint64_t, kMortonBits> differ_{};  // neighbours among the keys whose first difference is at that bit
  std::uint64_t keys_ = 0;
  MortonKey first_ = 0, last_ = 0;
};

// A pure function of the segments and the leaves. Immutable, but for the parts, which are thread-compatible.
class SampleChooser {
 public:
  SampleChooser(const Grid& grid, const SampleSurvey& survey, std::size_t most);

  // What some of the leaves contribute.
  class Part {
    friend class SampleChooser;
    struct Group {  // segments of a leaf in one cell
      MortonKey cell;
      GridPoint point;  // the middle nearest to that of the cell, lowest id
      double distance2;
      SegmentId id;
      GridBox ends;
      double radius2;  // within which the point covers them
    };
    struct Piece {
      GridPoint point;
      SegmentId id;
      float t;
    };
    std::vector<Group> groups_;
    std::vector<Piece> pieces_;
    double piece_radius_ = 0;  // quanta
    std::vector<std::uint32_t> table_, group_of_;
    std::map<MortonKey, std::uint32_t> sparse_;
  };
  // The segments of a leaf; those that it does not own are passed over. O(n).
  void addLeaf(const CellKey& leaf, std::span<const StoredSegment> segments, Part& part) const;
  // At most `most` points, ascending by Morton key, and the radius within which they cover every point of every
  // segment: tight where a cell of the points lies within a leaf, else by the boxes of the leaves in it. A point lies
  // within one quantum of its segment. O(p log p) for p points.
  SamplePoints finish(std::span<Part> parts) const;

 private:
  Grid grid_;
  int depth_ = 0;           // of the cells
  int piece_exponent_ = 0;  // longer segments than 2^this quanta get points of their own
};

// From the owned segments of all tiles of a store; reads every tile. The survey takes 16 bytes a segment.
SamplePoints chooseSamples(const TileStore& store, std::size_t most);
SamplePoints chooseSamples(const TileStore& store);  // as many as the set gets

}  // namespace filiform
