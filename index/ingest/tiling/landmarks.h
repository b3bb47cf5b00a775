// Landmarks: a few points that stand for the whole data set. A search tree over them bounds any nearest-segment search
// without a disk read. The tree alone also answers such a search, with a stated error.
//
// Space is divided into equal blocks, as small as the number of landmarks allows. In each block, the segment midpoint
// nearest to the block's centre stands for all segments with a midpoint in the block. Segments longer than a block also
// get landmarks along their length. So leaves can be processed one by one, in any order.
#pragma once

#include "index/set/tile_store.h"

#include <array>
#include <map>
#include <span>

namespace filiform {

// Most landmarks of a set.
inline constexpr std::size_t kMaxLandmarks = 65536;

// Number of landmarks for a set of `segments` segments: one for 128 segments, at least 64, at most kMaxLandmarks.
std::size_t landmarksFor(std::uint64_t segments);

// Statistics from which the spacing of landmarks follows. Thread rule: thread-compatible.
class LandmarkSurvey {
 public:
  // Adds the length of one segment; every segment once, in any order.
  void addLength(const GridPoint& a, const GridPoint& b);
  // Adds the Morton keys of midpoints: all keys, ascending, in one call or in several consecutive calls.
  void addKeys(std::span<const MortonKey> sorted);
  // Merges the survey of the next key range.
  void add(const LandmarkSurvey& next);
  std::uint64_t keys() const { return keys_; }
  // For another process of the same program.
  std::vector<std::uint8_t> encode() const;
  static LandmarkSurvey decode(std::span<const std::uint8_t> bytes);

 private:
  friend class LandmarkChooser;
  void join(MortonKey next);
  std::array<std::uint64_t, kMortonAxisBits + 3> longer_{};  // by e: number of lengths in (2^(e-1), 2^e] quanta
  std::array<std::uint64_t, kMortonBits> differ_{};  // by bit: number of neighbouring keys that first differ there
  std::uint64_t keys_ = 0;
  MortonKey first_ = 0, last_ = 0;
};

// Chooses the landmarks. The result depends only on the segments and the leaves. Thread rule: immutable; a Part is
// thread-compatible.
class LandmarkChooser {
 public:
  // `most`: the largest number of landmarks.
  LandmarkChooser(const Grid& grid, const LandmarkSurvey& survey, std::size_t most);

  // The contribution of some leaves. Each worker thread has its own Part.
  class Part {
   public:
    // For another process of the same program: the contribution so far.
    std::vector<std::uint8_t> encode() const;
    static Part decode(std::span<const std::uint8_t> bytes);

   private:
    friend class LandmarkChooser;
    struct Group {  // segments of one leaf in one block
      MortonKey block;
      GridPoint point;  // the midpoint nearest to the block's centre, lowest id
      double distance2;
      SegmentId id;
      GridBox ends;
      double radius2;  // squared distance within which `point` covers them
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
  // Adds those of the segments that the leaf owns to `part`. O(n).
  void addLeaf(const BlockKey& leaf, std::span<const StoredSegment> segments, Part& part) const;
  // Returns at most `most` landmarks, ascending by Morton key, and their covering radius. Every point of every segment
  // lies within this radius of a landmark. The radius is tight if a block of the landmarks lies within a leaf;
  // otherwise it follows from the boxes of the leaves. Each landmark lies within one quantum of its segment. O(p log p)
  // for p landmarks.
  Landmarks finish(std::span<Part> parts) const;

 private:
  Grid grid_;
  int depth_ = 0;           // of the blocks
  int piece_exponent_ = 0;  // segments longer than 2^this quanta get landmarks along their length
};

// Chooses landmarks from the owned segments of all tiles; reads every tile. Takes 16 bytes a segment.
Landmarks chooseLandmarks(const TileStore& store, std::size_t most);
Landmarks chooseLandmarks(const TileStore& store);  // landmarksFor() landmarks

}  // namespace filiform
