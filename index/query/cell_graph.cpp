#include "index/query/cell_graph.h"

#include "index/cell/internal/spanning_forest.h"
#include "index/errors.h"
#include "index/file/internal/decimals.h"
#include "index/query/soma_finder.h"
#include "index/set/tiles_ahead.h"

#include <algorithm>
#include <bit>
#include <charconv>
#include <cmath>
#include <cstdio>
#include <ostream>

namespace filiform {
namespace {

// The tile's first segment whose cell id is at least `cell`.
std::uint32_t firstOf(const Tile& tile, std::uint32_t cell) {
  std::uint32_t low = 0, high = tile.segment_count();
  while (low < high) {
    const std::uint32_t middle = low + (high - low) / 2;
    if (tile.segmentId(middle).cell < cell) {
      low = middle + 1;
    } else {
      high = middle;
    }
  }
  return low;
}

// Memory for a cell follows what its tiles hold, not what its record states: beyond kFirstRoom samples, at most
// kRoomASegment samples for each segment that has arrived.
constexpr std::uint64_t kFirstRoom = std::uint64_t{1} << 20, kRoomASegment = 8;

class Assembly {
 public:
  Assembly(CellGraph& graph, const CellRecord& record, std::uint32_t cell, bool with_appearance)
      : graph_(graph),
        cell_(cell),
        has_loops_(hasLoops(record)),
        with_appearance_(with_appearance),
        samples_(record.samples),
        segments_(has_loops_ ? record.segments + record.isolated : record.samples) {
    makeRoom(kFirstRoom);
  }

  [[noreturn]] void fail(const std::string& why) const {
    throw CorruptSet("cell " + std::to_string(cell_) + " of the tile set", 0, why);
  }

  // Makes room for a tile's segments. Returns false if they need more room than there may be so far: pass the tile
  // again after endTiles().
  bool takes(const Tile& tile) {
    if (room_ == most()) return true;
    std::uint64_t end = 0;
    for (std::uint32_t s = firstOf(tile, cell_); s < tile.segment_count() && tile.segmentId(s).cell == cell_; ++s) {
      if (!tile.owned(s)) continue;
      ++arrived_;
      const auto rank = [&tile](std::uint32_t node) { return std::uint64_t{tile.nodeId(node).sample}; };
      end = std::max(
          {end, rank(tile.child(s)) + 1, rank(tile.parent(s)) + 1, tile.segmentId(s).segment + std::uint64_t{1}});
    }
    makeRoom(kFirstRoom + kRoomASegment * arrived_);
    return std::min(end, most()) <= room_;
  }
  void endTiles(std::size_t roots) {
    if (room_ < most() && (arrived_ + roots < samples_ || (has_loops_ && arrived_ < segments_)))
      fail("its tiles hold fewer samples than its record states");
    makeRoom(most());
  }

  void place(std::uint32_t rank, const GridPoint& p) {
    if (rank >= samples_) fail("sample " + std::to_string(rank) + " does not exist");
    if (placed_[rank] && graph_.positions[rank] != p) fail("sample " + std::to_string(rank) + " is in two places");
    placed_[rank] = 1;
    graph_.positions[rank] = p;
  }
  void link(std::uint32_t segment, std::uint32_t child, std::uint32_t parent) {
    if (segment >= segments_ || (!has_loops_ && segment != child))
      fail("segment does not exist: " + std::to_string(segment));
    if (linked_[segment]) fail("segment " + std::to_string(segment) + " has two owners");
    linked_[segment] = 1;
    if (has_loops_) {
      graph_.links[segment] = {child, parent};
    } else if (parent != child) {
      graph_.parents[child] = parent;
    }
  }
  void finish(const std::vector<CellDetail::Root>& roots) {
    std::vector<std::uint8_t> is_root(placed_.size(), 0);
    for (const CellDetail::Root& root : roots) is_root[root.rank] = 1;
    for (std::size_t i = 0; i < placed_.size(); ++i)
      if (!placed_[i]) fail("sample " + std::to_string(i) + " is in no tile");
    for (std::size_t i = 0; i < linked_.size(); ++i)
      if (!linked_[i] && (has_loops_ || !is_root[i])) fail("segment " + std::to_string(i) + " has no owner");
    if (has_loops_) graph_.parents = spanningForest(placed_.size(), graph_.links).parents;
    for (std::size_t i = 0; !has_loops_ && i < placed_.size(); ++i)
      if (graph_.parents[i] != kNoParent && is_root[i]) fail("root " + std::to_string(i) + " has a parent");
  }

 private:
  std::uint64_t most() const { return std::max(samples_, segments_); }
  void makeRoom(std::uint64_t room) {
    room_ = std::min(std::max(room, room_), most());
    const std::uint64_t samples = std::min(room_, samples_), segments = std::min(room_, segments_);
    placed_.resize(samples);
    linked_.resize(segments);
    graph_.positions.resize(samples, GridPoint::Zero());
    graph_.parents.resize(samples, kNoParent);
    if (has_loops_) graph_.links.resize(segments);
    if (!with_appearance_) return;
    graph_.radii_um.resize(samples, kUnknownRadius);
    graph_.types.resize(samples);
  }

  CellGraph& graph_;
  std::uint32_t cell_;
  bool has_loops_, with_appearance_;
  std::uint64_t samples_, segments_, room_ = 0, arrived_ = 0;  // arrived: segments in tiles
  std::vector<std::uint8_t> placed_, linked_;
};

std::string hexEscaped(const std::string& bytes) {
  std::string text;
  for (unsigned char c : bytes) {
    if (c >= 0x20 && c != 0x7F) {
      text += static_cast<char>(c);
      continue;
    }
    char code[8];
    std::snprintf(code, sizeof code, "\\x%02X", static_cast<unsigned>(c));
    text += code;
  }
  return text;
}

class Line {
 public:
  void number(auto value) {
    blank();
    at_ = std::to_chars(at_, text_ + sizeof text_, value).ptr;
  }
  void coordinate(double um, const Grid& grid) {
    blank();
    at_ = internal::putCoordinate(at_, um, grid);
  }
  void radius(const CellGraph& cell, std::uint32_t rank) {
    blank();
    const double odd_um = cell.oddRadius_um(rank);
    at_ = std::isnan(odd_um) ? internal::putRadius(at_, cell.radii_um[rank]) : internal::putRadius(at_, odd_um);
  }
  void writeTo(std::ostream& out) {
    *at_++ = '\n';
    out.write(text_, at_ - text_);
    at_ = text_;
  }

 private:
  void blank() {
    if (at_ != text_) *at_++ = ' ';
  }
  char text_[512];
  char* at_ = text_;
};

CellSomata readSomata(const TileStore& store, std::uint32_t cell, const CellGraph& graph, const CellDetail& detail) {
  if (graph.isGraph() || std::none_of(detail.roots.begin(), detail.roots.end(),
                                      [](const CellDetail::Root& root) { return root.type == kSomaType; }))
    return {};
  if (!graph.types.empty()) {
    std::vector<Vector3d> positions_um(graph.samples());
    for (std::uint32_t rank = 0; rank < graph.samples(); ++rank) positions_um[rank] = graph.position_W(rank);
    return somataOf(graph.parents, positions_um, graph.radii_um, graph.types,
                    graph.grid.quantum_um() * std::sqrt(3.0) / 2);
  }
  CellSomata found;
  SomaFinder finder(store);
  finder.offer(cell, detail);
  for (const CellDetail::Root& root : detail.roots)
    if (root.type == kSomaType)
      if (const auto soma = finder.of({cell, root.rank}, graph.positions[root.rank])) found.somata.push_back(*soma);
  return found;
}

}  // namespace

std::vector<std::array<std::uint32_t, 2>> parentLinks(const CellGraph& cell) {
  std::vector<std::array<std::uint32_t, 2>> links;
  for (const auto& [child, parent] : cell.links)
    if (child != parent) links.push_back({parent, child});
  for (std::uint32_t i = 0; !cell.isGraph() && i < cell.samples(); ++i)
    if (cell.parents[i] != kNoParent) links.push_back({cell.parents[i], i});
  return links;
}

std::vector<std::int64_t> distinctIds(const CellGraph& cell) { return distinctIds(cell.sample_ids, cell.block_starts); }

CellGraph readCell(const TileStore& store, std::uint32_t cell, bool with_appearance, const std::atomic<bool>* stop) {
  const CellRecord& record = store.cell(cell);
  CellDetail detail = store.loadCellDetail(cell);
  CellGraph graph;
  graph.name = record.name;
  graph.source = record.source;
  graph.grid = store.grid();
  Assembly assembly(graph, record, cell, with_appearance);
  std::vector<TileId> later;
  const auto take = [&](const std::vector<TileId>& tiles) {
    TilesAhead ahead(store, tiles, with_appearance);
    for (const TileId id : tiles) {
      if (stop != nullptr && stop->load(std::memory_order_relaxed)) throw Interrupted("the cell is no longer wanted");
      const auto [tile, appearance] = ahead.next();
      if (!assembly.takes(*tile)) {
        later.push_back(id);
        continue;
      }
      std::uint32_t s = firstOf(*tile, cell);
      std::uint32_t owned = s < tile->segment_count() ? tile->ownedIndex(s) : 0;
      for (; s < tile->segment_count() && tile->segmentId(s).cell == cell; ++s) {
        if (!tile->owned(s)) continue;
        const std::uint32_t look = owned++;
        const std::uint32_t child = tile->nodeId(tile->child(s)).sample, parent = tile->nodeId(tile->parent(s)).sample;
        assembly.place(child, tile->gridPoint(tile->child(s)));
        assembly.place(parent, tile->gridPoint(tile->parent(s)));
        assembly.link(tile->segmentId(s).segment, child, parent);
        if (!with_appearance) continue;
        graph.radii_um[child] = appearance.radii_um[look];
        graph.types[child] = appearance.types[look];
      }
    }
  };
  take(detail.tiles);
  assembly.endTiles(detail.roots.size());
  take(later);
  for (const CellDetail::Root& root : detail.roots) {
    if (!with_appearance) break;
    graph.radii_um[root.rank] = root.radius_um;
    graph.types[root.rank] = root.type;
  }
  assembly.finish(detail.roots);
  graph.header = std::move(detail.header);
  if (with_appearance && !detail.odd_radii.empty()) {
    graph.odd_radii_um.assign(graph.samples(), kUnknownRadius);
    for (const CellDetail::OddBits& odd : detail.odd_radii) {
      const auto bits = std::bit_cast<std::uint64_t>(static_cast<double>(graph.radii_um[odd.rank]));
      const auto radius_um = std::bit_cast<double>(bits + static_cast<std::uint64_t>(odd.difference));
      graph.odd_radii_um[odd.rank] = radius_um;
      if (!(radius_um > 0) || storedRadius(radius_um) != graph.radii_um[odd.rank])
        assembly.fail("the radius of sample " + std::to_string(odd.rank) + " is not the one in its tile");
    }
  }
  graph.somata = readSomata(store, cell, graph, detail);
  graph.sample_ids = detail.sample_ids.all();
  graph.block_starts = std::move(detail.block_starts);
  return graph;
}

void writeHeader(std::ostream& out, const CellGraph& cell, const std::vector<std::string>& lines) {
  const std::string between = '\n' + cell.header + '\n';
  if (!cell.header.empty()) out << cell.header << '\n';
  for (const std::string& line : lines)
    if (between.find('\n' + line + '\n') == std::string::npos) out << line << '\n';
}

void writeSwc(std::ostream& out, const CellGraph& cell) {
  if (cell.isGraph())
    throw InputError("'" + hexEscaped(cell.name) +
                     "' has loops, which SWC cannot hold; write an edge list instead, such as " + "-o cell.edges");
  writeHeader(
      out, cell,
      {"# " + hexEscaped(cell.name), "# source: " + hexEscaped(cell.source), "# id type x y z radius parent, um"});
  const std::vector<std::int64_t> ids = distinctIds(cell);
  if (ids != cell.sample_ids)
    out << "# ids began again in the source at " << cell.block_starts.size()
        << " place(s); from there on they are renumbered past the highest before\n";
  Line line;
  for (std::uint32_t i = 0; i < cell.samples(); ++i) {
    const Vector3d p_W = cell.position_W(i);
    line.number(ids[i]);
    line.number(cell.types[i]);
    for (int axis = 0; axis < 3; ++axis) line.coordinate(p_W[axis], cell.grid);
    if (std::isnan(cell.radii_um[i])) {
      line.number(0);
    } else {
      line.radius(cell, i);
    }
    line.number(cell.parents[i] == kNoParent ? std::int64_t{-1} : ids[cell.parents[i]]);
    line.writeTo(out);
  }
}

}  // namespace filiform
