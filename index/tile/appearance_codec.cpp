#include "index/errors.h"
#include "index/file/internal/bytes.h"
#include "index/tile/tile_codec.h"

#include <algorithm>
#include <bit>

namespace filiform {

using internal::ByteReader;
using internal::Bytes;
using internal::ByteWriter;
using internal::Damage;
using internal::packedBytes;

namespace {

// Flags of the radii.
constexpr std::uint8_t kRunsOfRadii = 1;   // one value a run of equal radii; else one a segment
constexpr std::uint8_t kTableOfRadii = 2;  // values are positions in a table

// The distinct radii, as unsigned bits. Only these are sorted, since there are usually few.
class RadiusTable {
 public:
  explicit RadiusTable(const std::vector<std::uint32_t>& radii) {
    const int log_slots = std::bit_width(2 * radii.size() + 1);
    std::vector<std::uint32_t> slots(std::size_t{1} << log_slots, kFree);
    places_.reserve(radii.size());
    for (const std::uint32_t bits : radii) {
      std::size_t slot = (bits * std::uint64_t{0x9E3779B97F4A7C15}) >> (64 - log_slots);
      while (slots[slot] != kFree && sorted_[slots[slot]] != bits) slot = (slot + 1) & (slots.size() - 1);
      if (slots[slot] == kFree) {
        slots[slot] = static_cast<std::uint32_t>(sorted_.size());
        sorted_.push_back(bits);
      }
      places_.push_back(slots[slot]);
    }
    std::vector<std::uint64_t> order;  // bits, then the order of first use
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
  // The bytes of the table: its size, then each entry's difference from the one before.
  Bytes encoded() const {
    ByteWriter out;
    out.varint(sorted_.size());
    std::uint32_t before = 0;
    for (const std::uint32_t bits : sorted_) {
      out.varint(bits - before);
      before = bits;
    }
    return out.take();
  }
  int rankBits() const { return sorted_.empty() ? 0 : internal::bitsFor(sorted_.size() - 1); }
  std::uint64_t rank(std::size_t i) const { return ranks_[places_[i]]; }  // of the i-th radius

 private:
  static constexpr std::uint32_t kFree = UINT32_MAX;
  std::vector<std::uint32_t> sorted_, places_;
  std::vector<std::uint64_t> ranks_;  // by place
};

void writeTypes(const std::vector<std::uint16_t>& types, ByteWriter& out) {
  for (std::size_t i = 0; i < types.size();) {
    std::size_t end = i + 1;
    while (end < types.size() && types[end] == types[i]) ++end;
    out.u16(types[i]);
    out.varint(end - i - 1);
    i = end;
  }
}

void writeRadii(const std::vector<float>& radii_um, ByteWriter& out) {
  std::vector<std::uint32_t> of_runs;  // runs of equal radii
  std::vector<std::uint64_t> changes, run_of;
  changes.reserve(radii_um.size());
  run_of.reserve(radii_um.size());
  for (const float radius : radii_um) {
    const auto bits = std::bit_cast<std::uint32_t>(radius);
    const bool is_new = of_runs.empty() || of_runs.back() != bits;
    if (!run_of.empty()) changes.push_back(is_new ? 1 : 0);
    if (is_new) of_runs.push_back(bits);
    run_of.push_back(of_runs.size() - 1);
  }
  const RadiusTable distinct(of_runs);
  const Bytes table = distinct.encoded();
  const auto inTable = [&](std::size_t count) { return table.size() + packedBytes(count, distinct.rankBits()); };
  const auto least = [&](std::size_t count) { return std::min<std::uint64_t>(4 * count, inTable(count)); };
  const bool runs = packedBytes(changes.size(), 1) + least(of_runs.size()) < least(radii_um.size());
  const std::size_t count = runs ? of_runs.size() : radii_um.size();
  const bool in_table = inTable(count) < 4 * count;
  out.u8(static_cast<std::uint8_t>((runs ? kRunsOfRadii : 0) | (in_table ? kTableOfRadii : 0)));
  if (runs) internal::packBits(out, changes, 1);
  const auto runAt = [&](std::size_t i) { return runs ? i : run_of[i]; };
  if (!in_table) {
    for (std::size_t i = 0; i < count; ++i) out.u32(of_runs[runAt(i)]);
    return;
  }
  out.append(table);
  std::vector<std::uint64_t> ranks;
  ranks.reserve(count);
  for (std::size_t i = 0; i < count; ++i) ranks.push_back(distinct.rank(runAt(i)));
  internal::packBits(out, ranks, distinct.rankBits());
}

std::vector<std::uint16_t> readTypes(ByteReader& in, std::uint32_t count) {
  std::vector<std::uint16_t> types;
  while (types.size() < count) {
    const std::uint16_t type = in.u16();
    const std::uint64_t run = in.varint() + 1;
    in.require(run >= 1 && run <= count - types.size(), "a run of types is too long");
    types.insert(types.end(), run, type);
  }
  return types;
}

std::vector<float> readRadiusList(ByteReader& in, std::size_t count, bool in_table) {
  std::vector<float> radii;
  if (!in_table) {
    in.require(count <= in.left() / 4, "more radii than there are bytes");
    radii.reserve(count);
    for (std::size_t i = 0; i < count; ++i) radii.push_back(in.f32());
    return radii;
  }
  const std::uint32_t table_size = in.varint32();
  in.require(table_size <= in.left() && (table_size > 0 || count == 0), "more radii than there are bytes");
  std::vector<float> table;
  table.reserve(table_size);
  std::uint32_t bits = 0;
  for (std::uint32_t i = 0; i < table_size; ++i) {
    const std::uint32_t step = in.varint32();
    in.require(step <= UINT32_MAX - bits, "a radius is too large");
    table.push_back(std::bit_cast<float>(bits += step));
  }
  std::vector<std::uint64_t> ranks(count);
  internal::unpackBits(in, ranks, table_size == 0 ? 0 : internal::bitsFor(table_size - 1));
  radii.reserve(count);
  for (const std::uint64_t rank : ranks) {
    in.require(rank < table_size, "a radius is not in the table");
    radii.push_back(table[rank]);
  }
  return radii;
}

std::vector<float> readRadii(ByteReader& in, std::uint32_t count) {
  const std::uint8_t flags = in.u8();
  in.require(flags <= (kRunsOfRadii | kTableOfRadii), "an unknown flag");
  const bool in_table = (flags & kTableOfRadii) != 0;
  if ((flags & kRunsOfRadii) == 0 || count == 0) return readRadiusList(in, count, in_table);
  std::vector<std::uint64_t> changes(count - 1);
  internal::unpackBits(in, changes, 1);
  const auto runs = static_cast<std::size_t>(1 + std::count(changes.begin(), changes.end(), 1));
  const std::vector<float> of_runs = readRadiusList(in, runs, in_table);
  std::vector<float> radii{of_runs[0]};
  radii.reserve(count);
  std::size_t run = 0;
  for (const std::uint64_t change : changes) radii.push_back(of_runs[run += change]);
  return radii;
}

}  // namespace

std::vector<std::uint8_t> encodeAppearance(const TileAppearance& appearance) {
  ByteWriter out;
  out.varint(appearance.types.size());
  writeTypes(appearance.types, out);
  writeRadii(appearance.radii_um, out);
  return out.take();
}

TileAppearance decodeAppearance(std::span<const std::uint8_t> bytes, const TilePlace& place, std::uint32_t count) {
  try {
    ByteReader in(bytes);
    // Runs of one type and a table of one radius take few bytes, so the bytes alone do not limit the number.
    in.require(in.varint32() == count, "the number of segments differs from the directory");
    TileAppearance appearance;
    appearance.types = readTypes(in, count);
    appearance.radii_um = readRadii(in, count);
    in.require(in.left() == 0, "bytes beyond the end of the appearance");
    return appearance;
  } catch (const Damage& damage) {
    throw CorruptTile(place.tile, place.file, place.offset + damage.offset, damage.what);
  }
}

}  // namespace filiform
