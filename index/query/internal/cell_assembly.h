// CellAssembly: puts a cell together from the segments that its tiles own, in any order of the tiles. Thread rule:
// thread-compatible.
#pragma once

#include "index/query/cell_graph.h"
#include "index/tile/passed_segment.h"

#include <algorithm>
#include <array>
#include <cstdint>
#include <span>
#include <string>
#include <vector>

namespace filiform::internal {

class CellAssembly {
 public:
  // `detail`: that of the cell. The store must outlive this object. Memory follows what the tiles hold, not what the
  // record states: beyond kFirstRoom samples, at most kRoomASegment samples for each segment that has arrived.
  CellAssembly(const TileStore& store, std::uint32_t cell, CellDetail detail, bool with_appearance);

  const std::vector<TileId>& tiles() const { return detail_.tiles; }  // that own a segment of the cell, ascending
  // Adds what a tile owns of the cell, or notes the tile for endTiles(). Throws CorruptSet.
  void add(TileId tile, std::span<const PassedSegment> segments);
  // Adds one segment after the other, faster. Requires takesEach(), and that tiles() has the tile. Valid until the next
  // call of the assembly.
  class Filling;
  bool takesEach() const { return room_ == most(); }
  // Call it after all tiles. Returns those to add() again. Throws CorruptSet.
  const std::vector<TileId>& endTiles();
  // Throws CorruptSet. Without appearance, reads the tiles of somata.
  CellGraph finish();

 private:
  // What the arrays hold before their samples and segments come: no coordinate of the grid, no link. A parent is then
  // the sample itself. Less is then written for each sample.
  static constexpr std::int64_t kUnplaced = INT64_MIN;
  static constexpr std::array<std::uint32_t, 2> kUnlinked{kNoParent, kNoParent};
  static constexpr std::uint64_t kFirstRoom = std::uint64_t{1} << 20, kRoomASegment = 8;

  [[noreturn]] void fail(const std::string& why) const;
  [[noreturn]] void failSample(std::uint32_t rank) const;
  [[noreturn]] void failSegment(const PassedSegment& segment) const;
  bool takes(std::span<const PassedSegment> segments);
  void makeRoom(std::uint64_t room);
  std::uint64_t most() const { return std::max(samples_, segments_); }
  void addOddRadii();
  CellSomata somata() const;

  const TileStore& store_;
  const std::uint32_t cell_;
  CellDetail detail_;
  CellGraph graph_;
  const bool with_appearance_;
  bool has_loops_;
  std::uint64_t samples_, segments_, room_ = 0, arrived_ = 0;  // arrived: segments in tiles
  std::vector<TileId> later_;
};

class CellAssembly::Filling {
 public:
  Filling() = default;
  explicit Filling(CellAssembly& to)
      : to_(&to),
        samples_(to.samples_),
        segments_(to.segments_),
        positions_(to.graph_.positions.data()),
        parents_(to.graph_.parents.data()),
        links_(to.has_loops_ ? to.graph_.links.data() : nullptr),
        radii_um_(to.with_appearance_ ? to.graph_.radii_um.data() : nullptr),
        types_(to.graph_.types.data()) {}

  [[gnu::always_inline]] void add(const PassedSegment& s) {
    place(s.child_sample, s.child);
    if (s.parent_sample != last_child_) place(s.parent_sample, s.parent);
    last_child_ = s.child_sample;
    const std::uint32_t segment = s.id.segment;
    if (links_ == nullptr) {
      if (segment != s.child_sample || parents_[segment] != segment) to_->failSegment(s);
      parents_[segment] = s.parent_sample == segment ? kNoParent : s.parent_sample;
    } else {
      if (segment >= segments_ || links_[segment] != kUnlinked) to_->failSegment(s);
      links_[segment] = {s.child_sample, s.parent_sample};
    }
    if (radii_um_ == nullptr) return;
    radii_um_[s.child_sample] = s.radius_um;
    types_[s.child_sample] = s.type;
  }

 private:
  [[gnu::always_inline]] void place(std::uint32_t rank, const GridPoint& p) {
    if (rank >= samples_ || (positions_[rank][0] != kUnplaced && positions_[rank] != p)) to_->failSample(rank);
    positions_[rank] = p;
  }

  const CellAssembly* to_ = nullptr;
  std::uint64_t samples_ = 0, segments_ = 0, last_child_ = UINT64_MAX;
  GridPoint* positions_ = nullptr;
  std::uint32_t* parents_ = nullptr;
  std::array<std::uint32_t, 2>* links_ = nullptr;  // null: a cell without loops
  float* radii_um_ = nullptr;                      // null: without appearance
  std::uint16_t* types_ = nullptr;
};

}  // namespace filiform::internal
