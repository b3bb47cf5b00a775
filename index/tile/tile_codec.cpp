#include "index/tile/tile_codec.h"

#include "index/errors.h"
#include "index/file/internal/bytes.h"
#include "index/file/internal/set_files.h"
#include "index/tile/internal/decode_scratch.h"
#include "index/tile/internal/run_order.h"
#include "index/tile/internal/tile_parts.h"

#include <algorithm>
#include <array>
#include <bit>

namespace filiform {

using internal::ByteReader;
using internal::ByteWriter;
using internal::Damage;

namespace {

constexpr std::uint8_t kGraph = 1;  // flag: fragments state their first samples and may be loose

std::int64_t difference(std::uint32_t a, std::uint32_t b) { return std::int64_t{a} - std::int64_t{b}; }

// Returns `from` minus the decoded step. Throws Damage unless this is an index below `limit`.
std::uint32_t steppedBack(const ByteReader& in, std::uint32_t from, std::uint64_t zigzagged, std::uint64_t limit,
                          const char* what) {
  const std::int64_t step = internal::unzigzag(zigzagged);
  in.require(step >= -std::int64_t{UINT32_MAX} && step <= std::int64_t{UINT32_MAX}, what);
  const std::int64_t at = std::int64_t{from} - step;
  in.require(at >= 0 && static_cast<std::uint64_t>(at) < limit, what);
  return static_cast<std::uint32_t>(at);
}

}  // namespace

std::vector<std::uint8_t> TileCodec::encode(const Tile& tile) {
  const bool graph = !tile.first_samples_.empty() || !tile.loose_.empty();
  GridPoint extent = GridPoint::Zero();
  tile.withOffsets([&](const auto& offsets) {
    for (std::uint32_t n = 0; n < tile.node_count_; ++n) {
      const Coordinates c = offsets.get(n);
      for (std::size_t axis = 0; axis < 3; ++axis) {
        std::int64_t& most = extent[static_cast<Eigen::Index>(axis)];
        most = std::max(most, static_cast<std::int64_t>(c[axis]));
      }
    }
  });
  if (!onGrid(tile.origin_) || !onGrid(tile.origin_ + extent)) throw InputError("a position lies outside the grid");

  ByteWriter out;
  out.u8(graph ? kGraph : 0);
  out.varint(tile.segment_count_);
  out.varint(tile.fragments_.size());
  out.varint(tile.strays_.size());
  out.point(tile.origin_);
  Widths widths;
  for (std::size_t axis = 0; axis < 3; ++axis) {
    widths[axis] = internal::bitsFor(static_cast<std::uint64_t>(extent[static_cast<Eigen::Index>(axis)]));
    out.u8(static_cast<std::uint8_t>(widths[axis]));
  }

  PositionOrder order;
  writeFragments(tile, graph, out, order);
  writeStrays(tile, out);
  writePositions(tile, order, widths, out);

  writeOwned(tile, out);
  writeRuns(tile, out);
  return out.take();
}

void TileCodec::writeFragments(const Tile& tile, bool graph, ByteWriter& out, PositionOrder& order) {
  std::uint32_t cell = 0, next_rank = 0, nodes = 0;
  for (std::uint32_t n = straysBegin(tile); n < tile.node_count_; ++n) order.stated.push_back(n);
  for (std::uint32_t f = 0; f < tile.fragments_.size(); ++f) {
    const Tile::Fragment& fragment = tile.fragments_[f];
    const std::uint32_t count = tile.fragmentEnd(f) - fragment.begin;
    const Kind kind = kindOf(tile, f);
    out.varint(4 * std::uint64_t{count - 1} + kind);
    out.varint(fragment.cell - cell);
    if (fragment.cell != cell) next_rank = 0;
    out.varint(fragment.first_rank - next_rank);
    if (graph) out.varint(internal::zigzag(difference(fragment.first_rank, tile.firstSample(f))));
    cell = fragment.cell;
    next_rank = fragment.first_rank + count;
    if (kind == kLoose) {
      out.varint(internal::zigzag(difference(nodes, fragment.child_node)));
      out.varint(internal::zigzag(difference(nodes, fragment.parent_node)));
      continue;
    }
    if (kind == kLinked) out.varint(internal::zigzag(difference(fragment.child_node, fragment.parent_node)));
    if (kind == kLead) order.stated.push_back(fragment.parent_node);
    if (standsAlone(tile, fragment)) {
      order.stated.push_back(fragment.child_node);
    } else {
      order.steps.emplace_back(fragment.child_node, fragment.parent_node);
    }
    for (std::uint32_t i = 1; i < count; ++i)
      order.steps.emplace_back(fragment.child_node + i, fragment.child_node + i - 1);
    nodes = fragment.child_node + count;
  }
}

void TileCodec::writeStrays(const Tile& tile, ByteWriter& out) {
  NodeId next{0, 0};
  for (const NodeId& stray : tile.strays_) {
    out.varint(stray.cell - next.cell);
    out.varint(stray.sample - (stray.cell == next.cell ? next.sample : 0));
    next = {stray.cell, stray.sample + 1};
  }
}

// A tile owns the segments whose midpoint lies in its block, except for those that are listed.
void TileCodec::writeOwned(const Tile& tile, ByteWriter& out) {
  const std::vector<std::uint32_t> inside = tile.midpointsInside();
  std::vector<std::uint32_t> others;
  for (std::uint32_t b = 0; b < inside.size(); ++b)
    for (std::uint32_t left = inside[b] ^ tile.segments_[b].owned; left != 0; left &= left - 1)
      others.push_back(32 * b + static_cast<std::uint32_t>(std::countr_zero(left)));
  out.varint(others.size());
  std::uint32_t next = 0;
  for (const std::uint32_t s : others) {
    out.varint(s - next);
    next = s + 1;
  }
}

// The groups of kTreeWidth runs in the order of the search tree: how many there are, and bits of a group's number.
struct RunGroups {
  std::size_t groups;
  int bits;

  explicit RunGroups(std::size_t runs)
      : groups((runs + internal::kTreeWidth - 1) / internal::kTreeWidth),
        bits(groups == 0 ? 0 : internal::bitsFor(groups - 1)) {}
};

void TileCodec::writeRuns(const Tile& tile, ByteWriter& out) {
  std::vector<std::uint64_t> group_at(tile.segment_count_), group_of;  // by first segment; by run
  for (std::size_t r = 0; r < tile.runs_.size(); ++r) group_at[tile.runs_[r].begin()] = r / internal::kTreeWidth;
  group_of.reserve(tile.runs_.size());
  for (std::uint32_t f = 0; f < tile.fragments_.size(); ++f)
    internal::forEachRun(tile.fragments_[f].begin, tile.fragmentEnd(f) - tile.fragments_[f].begin,
                         [&](SegmentRun run) { group_of.push_back(group_at[run.begin()]); });
  internal::packBits(out, group_of, RunGroups(group_of.size()).bits);
}

Tile TileCodec::decode(ByteReader& in, const TilePlace& place, const Grid& grid) {
  const internal::DecodeScratch::Trimmed trimmed;
  const std::uint8_t flags = in.u8();
  in.require((flags & ~kGraph) == 0, "an unknown flag");
  const bool graph = (flags & kGraph) != 0;
  const std::uint32_t count = in.varint32(), fragment_count = in.varint32(), stray_count = in.varint32();
  // Each fragment takes at least three bytes, each stray two.
  in.require(count <= Tile::kMaxSegments && count / internal::kMostSegmentsAByte <= in.left() &&
                 fragment_count / 3 <= in.left() && stray_count / 2 <= in.left(),
             "more segments than there are bytes");
  Tile tile(place.tile, place.key, place.is_long, grid);
  tile.segment_count_ = count;
  tile.origin_ = in.point();
  in.require(onGrid(tile.origin_), "the origin lies outside the grid");
  Widths widths;
  for (int& width : widths) {
    width = in.u8();
    in.require(width <= kMortonAxisBits, "a position is too wide");
  }

  const Fragments fragments = readFragments(in, tile, fragment_count, graph);
  tile.node_count_ = fragments.nodes + stray_count;
  readEnds(in, tile, fragments);
  readStrays(in, tile, stray_count);

  readPositions(in, tile, fragments.kinds, widths);
  tile.setHomes();
  const std::vector<std::uint32_t> owned = readOwned(in, tile);
  readRuns(in, tile);
  in.require(in.left() == 0, "bytes beyond the end of the tile");
  tile.index(owned, fragments.strips);
  return tile;
}

TileCodec::Fragments TileCodec::readFragments(ByteReader& in, Tile& tile, std::uint32_t fragment_count, bool graph) {
  Fragments found;
  found.kinds.reserve(fragment_count);
  found.strips.reserve(fragment_count);
  tile.fragments_.reserve(fragment_count);
  if (graph) tile.first_samples_.reserve(fragment_count);
  std::uint32_t cell = 0, at = 0, nodes = 0;
  std::uint64_t next_rank = 0, next_sample = 0;
  bool named = true;
  for (std::uint32_t f = 0; f < fragment_count; ++f) {
    const std::uint64_t head = in.varint();
    const auto kind = static_cast<Kind>(head % 4);
    const std::uint64_t n = head / 4 + 1;
    const std::uint32_t cell_step = in.varint32();
    in.require(cell_step <= UINT32_MAX - 1 - cell, "a cell number is too large");
    cell += cell_step;
    if (cell_step != 0) next_rank = next_sample = 0;
    const std::uint64_t rank = next_rank + in.varint32();
    in.require(n <= tile.segment_count_ - at && rank + n <= UINT32_MAX && (kind != kLoose || (graph && n == 1)),
               "a fragment is too long");
    next_rank = rank + n;
    const auto first_rank = static_cast<std::uint32_t>(rank);
    std::uint64_t sample = rank;
    if (graph) {
      sample = steppedBack(in, first_rank, in.varint(), UINT32_MAX, "a sample does not exist");
      in.require(sample + n <= UINT32_MAX, "a sample does not exist");
      tile.first_samples_.push_back(static_cast<std::uint32_t>(sample));
      named = named && sample == rank;
    }
    found.kinds.push_back(kind);
    if (kind == kLoose) {
      const std::uint64_t child = in.varint();
      found.ends.push_back({f, child, in.varint()});
      tile.fragments_.push_back({cell, first_rank, at, nodes, nodes});
      if (tile.loose_.empty()) tile.loose_.assign((fragment_count + 31) / 32, 0);
      tile.loose_[f / 32] |= 1u << (f % 32);
      ++at;
      continue;
    }
    found.strips.push_back(nodes);
    if (kind == kLead) {
      in.require(sample > next_sample || (graph && sample > 0), "a parent does not exist");
      ++nodes;
    }
    tile.fragments_.push_back({cell, first_rank, at, nodes, kind == kLead ? nodes - 1 : nodes});
    if (kind == kLinked) found.ends.push_back({f, 0, in.varint()});
    next_sample = sample + n;
    at += static_cast<std::uint32_t>(n);
    nodes += static_cast<std::uint32_t>(n);
  }
  in.require(at == tile.segment_count_, "the fragments' lengths do not match the number of segments");
  in.require(!graph || !named || !tile.loose_.empty(), "the graph flag is set without need");
  if (named) tile.first_samples_.clear();
  found.nodes = nodes;
  return found;
}

void TileCodec::readEnds(const ByteReader& in, Tile& tile, const Fragments& fragments) {
  for (const Fragments::Ends& e : fragments.ends) {
    Tile::Fragment& fragment = tile.fragments_[e.fragment];
    const std::uint32_t from = fragment.child_node;  // for a loose fragment: the nodes placed so far
    if (fragments.kinds[e.fragment] == kLoose)
      fragment.child_node = steppedBack(in, from, e.child, tile.node_count_, "a node does not exist");
    fragment.parent_node = steppedBack(in, from, e.parent, tile.node_count_, "a node does not exist");
    in.require(fragments.kinds[e.fragment] == kLoose || fragment.parent_node != fragment.child_node,
               "a sample is its own parent");
  }
}

void TileCodec::readStrays(ByteReader& in, Tile& tile, std::uint32_t stray_count) {
  NodeId next{0, 0};
  tile.strays_.reserve(stray_count);
  for (std::uint32_t i = 0; i < stray_count; ++i) {
    const std::uint32_t step = in.varint32();
    in.require(step <= UINT32_MAX - 1 - next.cell, "a cell number is too large");
    const std::uint64_t sample = std::uint64_t{step == 0 ? next.sample : 0} + in.varint32();
    in.require(sample < UINT32_MAX, "a sample does not exist");
    tile.strays_.push_back({next.cell + step, static_cast<std::uint32_t>(sample)});
    next = {next.cell + step, static_cast<std::uint32_t>(sample + 1)};
  }
}

std::vector<std::uint32_t> TileCodec::readOwned(ByteReader& in, const Tile& tile) {
  std::vector<std::uint32_t> owned = tile.midpointsInside();
  std::uint64_t next = 0;
  for (std::uint32_t left = in.varint32(); left > 0; --left) {
    const std::uint64_t s = next + in.varint32();
    in.require(s < tile.segment_count_, "a segment does not exist");
    owned[s / 32] ^= 1u << (s % 32);
    next = s + 1;
  }
  return owned;
}

void TileCodec::readRuns(ByteReader& in, Tile& tile) {
  std::size_t count = 0;
  for (std::uint32_t f = 0; f < tile.fragments_.size(); ++f)
    count += internal::runsOf(tile.fragmentEnd(f) - tile.fragments_[f].begin);
  const RunGroups tree(count);
  std::vector<std::uint64_t>& group_of = internal::DecodeScratch::here().group_of;
  group_of.resize(count);
  internal::unpackBits(in, group_of, tree.bits);
  std::vector<std::uint32_t>& next =
      internal::DecodeScratch::here().next_run;  // by group: its runs, then the next's place
  next.assign(std::size_t{1} << tree.bits, 0);
  for (const std::uint64_t group : group_of) ++next[group];
  for (std::size_t g = 0; g < next.size(); ++g) {
    const std::size_t begin = std::min(g * internal::kTreeWidth, count), end = begin + next[g];
    in.require(end == std::min((g + 1) * internal::kTreeWidth, count), "a group of runs has the wrong size");
    next[g] = static_cast<std::uint32_t>(begin);
  }
  tile.runs_.resize(count);
  std::size_t at = 0;
  for (std::uint32_t f = 0; f < tile.fragments_.size(); ++f)
    internal::forEachRun(tile.fragments_[f].begin, tile.fragmentEnd(f) - tile.fragments_[f].begin,
                         [&](SegmentRun run) { tile.runs_[next[group_of[at++]]++] = run; });
}

std::vector<std::uint8_t> encodeTile(const Tile& tile) { return TileCodec::encode(tile); }

Tile decodeTile(std::span<const std::uint8_t> bytes, const TilePlace& place, const Grid& grid) {
  try {
    ByteReader in(bytes);
    return TileCodec::decode(in, place, grid);
  } catch (const Damage& damage) {
    throw CorruptTile(place.tile, place.file, place.offset + damage.offset, damage.what);
  }
}

}  // namespace filiform
