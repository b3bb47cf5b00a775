#include "index/tile_codec.h"

#include "index/errors.h"
#include "index/internal/bytes.h"

#include <algorithm>
#include <array>
#include <bit>

namespace filiform {
namespace {

using internal::ByteReader;
using internal::ByteWriter;
using internal::Damage;

constexpr std::size_t kBlock = 32;
constexpr std::int64_t kEdge = std::int64_t{1} << (kMortonAxisBits - 1);

// A run of consecutive samples of one cell, each the child of the one before; the first hangs on `parent`.
struct Fragment {
  std::uint32_t cell, first_child, parent, begin, count;  // begin: among the tile's segments
};

std::vector<Fragment> fragmentsOf(const Tile& tile) {
  std::vector<Fragment> fragments;
  for (std::uint32_t s = 0; s < tile.segment_count(); ++s) {
    const NodeId child = tile.nodeId(tile.child(s)), parent = tile.nodeId(tile.parent(s));
    if (tile.segmentId(s).segment != child.sample)
      throw InputError("a segment that is not named after its child cannot be written in format version 1");
    if (!fragments.empty()) {
      Fragment& last = fragments.back();
      const std::uint32_t before = last.first_child + last.count - 1;
      if (last.cell == child.cell && parent.sample == before && child.sample == before + 1) {
        ++last.count;
        continue;
      }
    }
    fragments.push_back({child.cell, child.sample, parent.sample, s, 1});
  }
  return fragments;
}

// The different radii among many, as unsigned bits. Only they are sorted: as a rule there are few.
class RadiusTable {
 public:
  explicit RadiusTable(const std::vector<float>& radii_um) {
    const int log_slots = std::bit_width(2 * radii_um.size() + 1);
    std::vector<std::uint32_t> slots(std::size_t{1} << log_slots, kFree);
    places_.reserve(radii_um.size());
    for (const float radius : radii_um) {
      const auto bits = std::bit_cast<std::uint32_t>(radius);
      std::size_t slot = (bits * std::uint64_t{0x9E3779B97F4A7C15}) >> (64 - log_slots);
      while (slots[slot] != kFree && sorted_[slots[slot]] != bits) slot = (slot + 1) & (slots.size() - 1);
      if (slots[slot] == kFree) {
        slots[slot] = static_cast<std::uint32_t>(sorted_.size());
        sorted_.push_back(bits);
      }
      places_.push_back(slots[slot]);
    }
    std::vector<std::uint64_t> order;  // bits, then the place in which they were met
    order.reserve(sorted_.size());
    for (std::size_t place = 0; place < sorted_.size(); ++place)
      order.push_back(std::uint64_t{sorted_[place]} << 32 | place);
    std::sort(order.begin(), order.end());
    ranks_.resize(order.size());
    for (std::size_t rank = 0; rank < order.size(); ++rank) {
      sorted_[rank] = static_cast<std::uint32_t>(order[rank] >> 32);
      ranks_[static_cast<std::uint32_t>(order[rank])] = rank;
    }
  }
  const std::vector<std::uint32_t>& sorted() const { return sorted_; }
  std::vector<std::uint64_t> ranks() const {  // of each radius
    std::vector<std::uint64_t> all;
    all.reserve(places_.size());
    for (const std::uint32_t place : places_) all.push_back(ranks_[place]);
    return all;
  }

 private:
  static constexpr std::uint32_t kFree = UINT32_MAX;
  std::vector<std::uint32_t> sorted_, places_;
  std::vector<std::uint64_t> ranks_;  // by place
};

bool onGrid(const GridPoint& p) { return (p.array() >= -kEdge).all() && (p.array() < kEdge).all(); }

[[noreturn]] void rethrow(const Damage& damage, const TilePlace& place) {
  throw CorruptTile(place.tile, place.file, place.offset + damage.offset, damage.what);
}

}  // namespace

std::vector<std::uint8_t> encodeTile(const Tile& tile) {
  const std::vector<Fragment> fragments = fragmentsOf(tile);
  ByteWriter out;
  out.varint(tile.segment_count());
  out.varint(fragments.size());

  GridBox bounds;
  for (std::uint32_t n = 0; n < tile.node_count(); ++n) bounds.extend(tile.gridPoint(n));
  if (tile.node_count() == 0) bounds.extend(GridPoint::Zero());
  if (!onGrid(bounds.lo) || !onGrid(bounds.hi)) throw InputError("a position lies outside the grid");
  out.point(bounds.lo);

  std::uint32_t cell = 0, next_child = 0;
  for (const Fragment& f : fragments) {
    out.varint(f.cell - cell);
    if (f.cell != cell) next_child = 0;
    out.varint(f.first_child - next_child);
    out.varint(internal::zigzag(std::int64_t{f.first_child} - f.parent));
    out.varint(f.count - 1);
    cell = f.cell;
    next_child = f.first_child + f.count;
  }

  const GridPoint extent = bounds.hi - bounds.lo;
  std::vector<std::uint64_t> values;
  for (int axis = 0; axis < 3; ++axis)
    out.u8(static_cast<std::uint8_t>(internal::bitsFor(static_cast<std::uint64_t>(extent[axis]))));
  for (int axis = 0; axis < 3; ++axis) {
    values.clear();
    for (const Fragment& f : fragments)
      values.push_back(static_cast<std::uint64_t>(tile.gridPoint(tile.parent(f.begin))[axis] - bounds.lo[axis]));
    internal::packBits(out, values, internal::bitsFor(static_cast<std::uint64_t>(extent[axis])));
  }

  for (std::uint32_t begin = 0; begin < tile.segment_count(); begin += kBlock) {
    const std::uint32_t n = std::min<std::uint32_t>(kBlock, tile.segment_count() - begin);
    std::array<std::array<std::uint64_t, kBlock>, 3> deltas;
    std::array<std::uint64_t, 3> all{};
    for (std::uint32_t i = 0; i < n; ++i) {
      const GridPoint d = tile.gridPoint(tile.child(begin + i)) - tile.gridPoint(tile.parent(begin + i));
      for (std::size_t axis = 0; axis < 3; ++axis)
        all[axis] |= deltas[axis][i] = internal::zigzag(d[static_cast<Eigen::Index>(axis)]);
    }
    for (std::uint64_t bits : all) out.u8(static_cast<std::uint8_t>(internal::bitsFor(bits)));
    for (std::size_t axis = 0; axis < 3; ++axis)
      internal::packBits(out, std::span(deltas[axis]).first(n), internal::bitsFor(all[axis]));
  }

  values.clear();
  for (std::uint32_t s = 0; s < tile.segment_count(); ++s) values.push_back(tile.owned(s));
  internal::packBits(out, values, 1);
  return out.take();
}

Tile decodeTile(std::span<const std::uint8_t> bytes, const TilePlace& place, const Grid& grid) {
  try {
    ByteReader in(bytes);
    const std::uint32_t count = in.varint32(), fragment_count = in.varint32();
    // Each segment has a bit of its own, each fragment four bytes.
    in.require(count / 8 <= in.left() && fragment_count / 4 <= in.left(), "more segments than there are bytes");
    const GridPoint origin = in.point();
    in.require(onGrid(origin), "the origin lies outside the grid");

    std::vector<StoredSegment> segments(count);
    std::vector<std::uint32_t> begins;
    begins.reserve(fragment_count);
    std::uint32_t cell = 0, at = 0;
    std::uint64_t next_child = 0;
    for (std::uint32_t f = 0; f < fragment_count; ++f) {
      const std::uint32_t cell_step = in.varint32();
      in.require(cell_step <= UINT32_MAX - 1 - cell, "a cell number is too large");
      cell += cell_step;
      if (cell_step != 0) next_child = 0;
      const std::uint64_t first = next_child + in.varint32();
      const std::uint64_t step_back = in.varint();
      const std::uint64_t n = std::uint64_t{in.varint32()} + 1;
      in.require(n <= count - at && first + n <= UINT32_MAX, "a fragment is too long");
      const std::int64_t back = internal::unzigzag(step_back);
      in.require(back <= static_cast<std::int64_t>(first) &&
                     back > static_cast<std::int64_t>(first) - std::int64_t{UINT32_MAX},
                 "a parent does not exist");
      next_child = first + n;
      begins.push_back(at);
      auto parent = static_cast<std::uint32_t>(static_cast<std::int64_t>(first) - back);
      for (auto child = static_cast<std::uint32_t>(first); child < next_child; ++child, ++at) {
        segments[at] = {{cell, child}, child, parent, GridPoint::Zero(), GridPoint::Zero(), false};
        parent = child;
      }
    }
    in.require(at == count, "the fragments do not add up");

    std::array<int, 3> widths;
    for (int& width : widths) width = in.u8();
    std::vector<std::uint64_t> values(fragment_count);
    for (int axis = 0; axis < 3; ++axis) {
      in.require(widths[static_cast<std::size_t>(axis)] <= kMortonAxisBits, "a position is too wide");
      internal::unpackBits(in, values, widths[static_cast<std::size_t>(axis)]);
      for (std::uint32_t f = 0; f < fragment_count; ++f)
        segments[begins[f]].parent[axis] = origin[axis] + static_cast<std::int64_t>(values[f]);
    }

    std::size_t fragment = 0;
    GridPoint p = GridPoint::Zero();
    for (std::uint32_t begin = 0; begin < count; begin += kBlock) {
      const std::uint32_t n = std::min<std::uint32_t>(kBlock, count - begin);
      std::array<std::array<std::uint64_t, kBlock>, 3> deltas;
      for (int& width : widths) width = in.u8();
      for (std::size_t axis = 0; axis < 3; ++axis) {
        in.require(widths[axis] <= kMortonAxisBits + 1, "a step is too wide");
        internal::unpackBits(in, std::span(deltas[axis]).first(n), widths[axis]);
      }
      for (std::uint32_t i = 0; i < n; ++i) {
        StoredSegment& s = segments[begin + i];
        if (fragment < begins.size() && begins[fragment] == begin + i) {
          p = s.parent;
          ++fragment;
        }
        s.parent = p;
        for (std::size_t axis = 0; axis < 3; ++axis)
          p[static_cast<Eigen::Index>(axis)] += internal::unzigzag(deltas[axis][i]);
        in.require(onGrid(s.parent) && onGrid(p), "a position lies outside the grid");
        s.child = p;
        in.require(s.child_sample != s.parent_sample || s.child == s.parent, "an isolated sample has a length");
      }
    }

    const internal::ByteSpan owned = in.take(internal::packedBytes(count, 1));
    for (std::uint32_t s = 0; s < count; ++s) segments[s].owned = (owned[s / 8] >> (s % 8) & 1) != 0;
    in.require(count % 8 == 0 || owned.back() >> (count % 8) == 0, "bits beyond the last segment");
    in.require(in.left() == 0, "bytes beyond the end of the tile");
    return Tile(place.tile, place.key, place.is_long, grid, std::move(segments));
  } catch (const Damage& damage) {
    rethrow(damage, place);
  }
}

std::vector<std::uint8_t> encodeAppearance(const TileAppearance& appearance) {
  ByteWriter out;
  const std::size_t n = appearance.types.size();
  out.varint(n);
  for (std::size_t i = 0; i < n;) {
    std::size_t end = i + 1;
    while (end < n && appearance.types[end] == appearance.types[i]) ++end;
    out.u16(appearance.types[i]);
    out.varint(end - i - 1);
    i = end;
  }
  const RadiusTable radii(appearance.radii_um);
  const std::vector<std::uint32_t>& table = radii.sorted();
  const int width = table.empty() ? 0 : internal::bitsFor(table.size() - 1);
  const bool plain = 4 * table.size() + internal::packedBytes(n, width) >= 4 * n;
  out.varint(plain ? 0 : table.size());
  if (plain) {
    for (float radius : appearance.radii_um) out.u32(std::bit_cast<std::uint32_t>(radius));
    return out.take();
  }
  for (std::uint32_t b : table) out.u32(b);
  internal::packBits(out, radii.ranks(), width);
  return out.take();
}

TileAppearance decodeAppearance(std::span<const std::uint8_t> bytes, const TilePlace& place, std::uint32_t count) {
  try {
    ByteReader in(bytes);
    TileAppearance appearance;
    const std::uint32_t n = in.varint32();
    std::uint32_t left = n;
    // Runs of one type and a table of one radius take no bytes a segment, so the bytes alone do not bound n.
    in.require(n == count, "the number of segments is not that of the directory");
    while (left > 0) {
      const std::uint16_t type = in.u16();
      const std::uint64_t run = in.varint() + 1;
      in.require(run >= 1 && run <= left, "a run of types is too long");
      appearance.types.insert(appearance.types.end(), run, type);
      left -= static_cast<std::uint32_t>(run);
    }
    const std::uint32_t table_size = in.varint32();
    in.require(table_size <= in.left() / 4, "more radii than there are bytes");
    if (table_size == 0) {
      in.require(n <= in.left() / 4, "more radii than there are bytes");
      for (std::uint32_t i = 0; i < n; ++i) appearance.radii_um.push_back(in.f32());
    } else {
      std::vector<float> table;
      for (std::uint32_t i = 0; i < table_size; ++i) table.push_back(in.f32());
      std::vector<std::uint64_t> ranks(n);
      internal::unpackBits(in, ranks, internal::bitsFor(table_size - 1));
      appearance.radii_um.reserve(n);
      for (std::uint64_t rank : ranks) {
        in.require(rank < table_size, "a radius is not in the table");
        appearance.radii_um.push_back(table[rank]);
      }
    }
    in.require(in.left() == 0, "bytes beyond the end of the appearance");
    return appearance;
  } catch (const Damage& damage) {
    rethrow(damage, place);
  }
}

}  // namespace filiform
