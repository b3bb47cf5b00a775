#include "index/query/internal/cell_assembly.h"

#include "index/cell/internal/spanning_forest.h"
#include "index/errors.h"
#include "index/query/soma_finder.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <numeric>
#include <utility>

namespace filiform::internal {

CellAssembly::CellAssembly(const TileStore& store, std::uint32_t cell, CellDetail detail, bool with_appearance)
    : store_(store), cell_(cell), detail_(std::move(detail)), with_appearance_(with_appearance) {
  const CellRecord& record = store.cell(cell);
  has_loops_ = hasLoops(record);
  samples_ = record.samples;
  segments_ = has_loops_ ? record.segments + record.isolated : record.samples;
  graph_.name = record.name;
  graph_.source = record.source;
  graph_.grid = store.grid();
  makeRoom(kFirstRoom);
}

void CellAssembly::fail(const std::string& why) const {
  throw CorruptSet("cell " + std::to_string(cell_) + " of the tile set", 0, why);
}

// Makes room for the segments. Returns false if they need more room than there may be so far.
bool CellAssembly::takes(std::span<const PassedSegment> segments) {
  if (takesEach()) return true;
  std::uint64_t end = 0;
  for (const PassedSegment& s : segments)
    end = std::max(
        {end, s.child_sample + std::uint64_t{1}, s.parent_sample + std::uint64_t{1}, s.id.segment + std::uint64_t{1}});
  arrived_ += segments.size();
  makeRoom(kFirstRoom + kRoomASegment * arrived_);
  return std::min(end, most()) <= room_;
}

void CellAssembly::add(TileId tile, std::span<const PassedSegment> segments) {
  if (!takes(segments)) {
    later_.push_back(tile);
    return;
  }
  Filling filling(*this);
  for (const PassedSegment& s : segments) filling.add(s);
}

void CellAssembly::failSample(std::uint32_t rank) const {
  fail("sample " + std::to_string(rank) + (rank >= samples_ ? " does not exist" : " is in two places"));
}

void CellAssembly::failSegment(const PassedSegment& s) const {
  const std::uint32_t segment = s.id.segment;
  if (segment >= segments_ || (!has_loops_ && segment != s.child_sample))
    fail("segment does not exist: " + std::to_string(segment));
  fail("segment " + std::to_string(segment) + " has two owners");
}

const std::vector<TileId>& CellAssembly::endTiles() {
  if (room_ < most() && (arrived_ + detail_.roots.size() < samples_ || (has_loops_ && arrived_ < segments_)))
    fail("its tiles hold fewer samples than its record states");
  makeRoom(most());
  return later_;
}

CellGraph CellAssembly::finish() {
  std::vector<std::uint8_t> is_root(samples_, 0);
  for (const CellDetail::Root& root : detail_.roots) {
    is_root[root.rank] = 1;
    if (!with_appearance_) continue;
    graph_.radii_um[root.rank] = root.radius_um;
    graph_.types[root.rank] = root.type;
  }
  for (std::size_t i = 0; i < samples_; ++i)
    if (graph_.positions[i][0] == kUnplaced) fail("sample " + std::to_string(i) + " is in no tile");
  for (std::size_t i = 0; i < segments_; ++i)
    if (has_loops_ ? graph_.links[i] == kUnlinked : graph_.parents[i] == i && !is_root[i])
      fail("segment " + std::to_string(i) + " has no owner");
  if (has_loops_) graph_.parents = spanningForest(samples_, graph_.links).parents;
  for (std::size_t i = 0; !has_loops_ && i < samples_; ++i) {
    if (!is_root[i]) continue;
    if (graph_.parents[i] != kNoParent && graph_.parents[i] != i) fail("root " + std::to_string(i) + " has a parent");
    graph_.parents[i] = kNoParent;
  }
  graph_.header = std::move(detail_.header);
  if (with_appearance_ && !detail_.odd_radii.empty()) addOddRadii();
  graph_.somata = somata();
  graph_.sample_ids = detail_.sample_ids.all();
  graph_.block_starts = std::move(detail_.block_starts);
  return std::move(graph_);
}

void CellAssembly::addOddRadii() {
  graph_.odd_radii_um.assign(graph_.samples(), kUnknownRadius);
  for (const CellDetail::OddBits& odd : detail_.odd_radii) {
    const auto bits = std::bit_cast<std::uint64_t>(static_cast<double>(graph_.radii_um[odd.rank]));
    const auto radius_um = std::bit_cast<double>(bits + static_cast<std::uint64_t>(odd.difference));
    graph_.odd_radii_um[odd.rank] = radius_um;
    if (!(radius_um > 0) || storedRadius(radius_um) != graph_.radii_um[odd.rank])
      fail("the radius of sample " + std::to_string(odd.rank) + " is not the one in its tile");
  }
}

CellSomata CellAssembly::somata() const {
  if (graph_.isGraph() || std::none_of(detail_.roots.begin(), detail_.roots.end(),
                                       [](const CellDetail::Root& root) { return root.type == kSomaType; }))
    return {};
  if (!graph_.types.empty())
    return somataOf(
        graph_.parents, [this](std::uint32_t rank) { return graph_.position_W(rank); }, graph_.radii_um, graph_.types,
        graph_.grid.quantum_um() * std::sqrt(3.0) / 2);
  CellSomata found;
  SomaFinder finder(store_);
  finder.offer(cell_, detail_);
  for (const CellDetail::Root& root : detail_.roots)
    if (root.type == kSomaType)
      if (const auto soma = finder.of({cell_, root.rank}, graph_.positions[root.rank])) found.somata.push_back(*soma);
  return found;
}

void CellAssembly::makeRoom(std::uint64_t room) {
  room_ = std::min(std::max(room, room_), most());
  const std::uint64_t samples = std::min(room_, samples_), segments = std::min(room_, segments_);
  graph_.positions.resize(samples, GridPoint::Constant(kUnplaced));
  const std::size_t before = graph_.parents.size();
  graph_.parents.resize(samples);
  std::iota(graph_.parents.begin() + static_cast<std::ptrdiff_t>(before), graph_.parents.end(),
            static_cast<std::uint32_t>(before));
  if (has_loops_) graph_.links.resize(segments, kUnlinked);
  if (!with_appearance_) return;
  graph_.radii_um.resize(samples, kUnknownRadius);
  graph_.types.resize(samples);
}

}  // namespace filiform::internal
