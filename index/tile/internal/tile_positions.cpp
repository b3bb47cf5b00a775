#include "index/tile/internal/decode_scratch.h"
#include "index/tile/internal/narrow_nodes.h"
#include "index/tile/internal/tile_parts.h"

#include <algorithm>
#include <bit>
#include <cstring>

namespace filiform {

using internal::ByteReader;
using internal::ByteWriter;
using internal::DecodeScratch;
using internal::kStepGroup;
using internal::kStepWidthBits;
using internal::kWideSteps;

namespace {

using StepWidths = std::array<int, 3>;
constexpr int kMaxStepBits = kMortonAxisBits + 1;
constexpr std::size_t kMostGroupBytes = 5 + 3 * kStepGroup * kMaxStepBits / 8, kSlackOfPack = 8;

// Returns where they end.
std::uint8_t* writeStepWidths(std::uint8_t* at, const StepWidths& widths) {
  const int widest = *std::max_element(widths.begin(), widths.end());
  const bool wide = widest >> kStepWidthBits != 0;
  const int head = wide ? kWideSteps : widths[0] | widths[1] << kStepWidthBits | widths[2] << 2 * kStepWidthBits;
  *at++ = static_cast<std::uint8_t>(head);
  *at++ = static_cast<std::uint8_t>(head >> 8);
  if (wide)
    for (const int width : widths) *at++ = static_cast<std::uint8_t>(width);
  return at;
}

StepWidths readStepWidths(ByteReader& in) {
  const unsigned head = in.u16(), mask = (1u << kStepWidthBits) - 1;
  StepWidths widths;
  for (int axis = 0; axis < 3; ++axis)
    widths[static_cast<std::size_t>(axis)] = static_cast<int>(head >> axis * kStepWidthBits & mask);
  if ((head & kWideSteps) == 0) return widths;
  in.require(head == kWideSteps, "an unknown flag");
  for (int& width : widths) {
    width = in.u8();
    in.require(width <= kMaxStepBits, "a step is too wide");
  }
  return widths;
}

// The positions that are stored directly, in their order.
class StatedPositions {
 public:
  StatedPositions(ByteReader& in, std::size_t count, const std::array<int, 3>& widths) {
    for (std::size_t axis = 0; axis < 3; ++axis) {
      in.require(internal::packedBytes(count, widths[axis]) <= in.left(), "the bytes end too early");
      all_[axis].resize(count);
      internal::unpackBits(in, all_[axis], widths[axis]);
    }
  }
  Coordinates at(std::size_t i) const { return {all_[0][i], all_[1][i], all_[2][i]}; }
  Coordinates next() { return at(next_++); }

 private:
  std::array<std::vector<std::uint64_t>, 3>& all_ = DecodeScratch::here().stated;
  std::size_t next_ = 0;
};

// Reads steps one by one.
class StepReader {
 public:
  StepReader(ByteReader& in, std::size_t steps) : in_(in), left_(steps) {}
  // Adds the next step.
  void addTo(Coordinates& p) {
    if (at_ == end_) fill();
    for (std::size_t axis = 0; axis < 3; ++axis)
      p[axis] += static_cast<std::uint64_t>(internal::unzigzag(group_[axis][at_]));
    ++at_;
  }

 private:
  void fill() {
    end_ = std::min(kStepGroup, left_);
    const StepWidths widths = readStepWidths(in_);
    for (std::size_t axis = 0; axis < 3; ++axis)
      internal::unpackBits(in_, std::span(group_[axis]).first(end_), widths[axis]);
    left_ -= end_;
    at_ = 0;
  }

  ByteReader& in_;
  std::size_t left_, at_ = 0, end_ = 0;
  std::array<std::array<std::uint64_t, kStepGroup>, 3> group_;
};

// Three numbers of 16 bits in the lower bits of a word, x lowest.
struct NarrowTriple {
  std::uint64_t word = 0;

  static constexpr std::uint64_t kHighs = 0x8000800080008000, kUsed = 0xffffffffffff;
  static NarrowTriple of(const Coordinates& c) { return {c[0] | c[1] << 16 | c[2] << 32}; }
  static NarrowTriple load(const std::uint16_t* from) {  // reads a fourth number
    NarrowTriple p;
    std::memcpy(&p.word, from, sizeof p.word);
    p.word &= kUsed;
    return p;
  }
  void store(std::uint16_t* to) const { std::memcpy(to, &word, sizeof word); }  // writes a fourth number
  // Modulo 2^16.
  NarrowTriple operator+(NarrowTriple b) const {
    return {((word & ~kHighs) + (b.word & ~kHighs)) ^ ((word ^ b.word) & kHighs)};
  }
  NarrowTriple operator-(NarrowTriple b) const {
    return {((word | kHighs) - (b.word & ~kHighs)) ^ ((word ^ ~b.word) & kHighs)};
  }
};

void requireWithin(const ByteReader& in, const Coordinates& bits, const std::array<int, 3>& widths) {
  for (std::size_t axis = 0; axis < 3; ++axis)
    in.require(internal::bitsFor(bits[axis]) <= widths[axis], "a position lies outside the tile");
}

}  // namespace

void TileCodec::writePositions(const Tile& tile, const PositionOrder& order, const Widths& widths, ByteWriter& out) {
  const std::vector<std::pair<std::uint32_t, std::uint32_t>>& steps = order.steps;
  std::vector<std::uint64_t> values;
  for (std::size_t axis = 0; axis < 3; ++axis) {
    values.clear();
    for (const std::uint32_t n : order.stated)
      values.push_back(static_cast<std::uint64_t>(tile.offset(n)[static_cast<Eigen::Index>(axis)]));
    internal::packBits(out, values, widths[axis]);
  }
  for (std::size_t begin = 0; begin < steps.size(); begin += kStepGroup) {
    const std::size_t n = std::min(kStepGroup, steps.size() - begin);
    std::array<std::array<std::uint64_t, kStepGroup>, 3> deltas;
    std::array<std::uint64_t, 3> all{};
    tile.withOffsets([&](const auto& offsets) {
      for (std::size_t i = 0; i < n; ++i) {
        const Coordinates to = offsets.get(steps[begin + i].first), from = offsets.get(steps[begin + i].second);
        for (std::size_t axis = 0; axis < 3; ++axis)
          all[axis] |= deltas[axis][i] = internal::zigzag(static_cast<std::int64_t>(to[axis] - from[axis]));
      }
    });
    const StepWidths step_widths{internal::bitsFor(all[0]), internal::bitsFor(all[1]), internal::bitsFor(all[2])};
    std::array<std::uint8_t, kMostGroupBytes + kSlackOfPack> group;
    std::uint8_t* at = writeStepWidths(group.data(), step_widths);
    for (std::size_t axis = 0; axis < 3; ++axis)
      at = internal::packBits(at, std::span(deltas[axis]).first(n), step_widths[axis]);
    out.append({group.data(), at});
  }
}

TileCodec::PositionCounts TileCodec::countPositions(const Tile& tile, std::span<const Kind> kinds) {
  PositionCounts counts{tile.strays_.size(), 0};
  for (std::uint32_t f = 0; f < kinds.size(); ++f) {
    if (kinds[f] == kLoose) continue;
    const std::size_t first = standsAlone(tile, tile.fragments_[f]) ? 1 : 0;
    counts.stated += (kinds[f] == kLead ? 1 : 0) + first;
    counts.steps += tile.fragmentEnd(f) - tile.fragments_[f].begin - first;
  }
  return counts;
}

template <class Offsets>
void TileCodec::readWidePositions(ByteReader& in, const Tile& tile, std::span<const Kind> kinds, const Widths& widths,
                                  const Offsets& out) {
  const PositionCounts counts = countPositions(tile, kinds);
  StatedPositions stated(in, counts.stated, widths);
  StepReader steps(in, counts.steps);
  Coordinates p{}, all{};  // the current position; the union of all coordinates' bits
  const auto put = [&](std::uint32_t node) {
    for (std::size_t axis = 0; axis < 3; ++axis) all[axis] |= p[axis];
    out.put(node, p);
  };
  const auto putStated = [&](std::uint32_t node) {
    p = stated.next();
    put(node);
  };
  for (std::uint32_t node = straysBegin(tile); node < tile.node_count_; ++node) putStated(node);
  for (std::uint32_t f = 0; f < kinds.size(); ++f) {
    if (kinds[f] == kLoose) continue;
    const Tile::Fragment& fragment = tile.fragments_[f];
    std::uint32_t node = fragment.child_node;
    const std::uint32_t end = node + (tile.fragmentEnd(f) - fragment.begin);
    if (kinds[f] == kLead) putStated(fragment.parent_node);
    if (standsAlone(tile, fragment)) {
      putStated(node++);
    } else if (kinds[f] == kLinked) {
      p = out.get(fragment.parent_node);
    }
    for (; node < end; ++node) {
      steps.addTo(p);
      put(node);
    }
  }
  requireWithin(in, all, widths);
}

// Adds the running sums of all steps to each fragment's first position. Only for little-endian machines.
void TileCodec::readNarrowPositions(ByteReader& in, const Tile& tile, std::span<const Kind> kinds, const Widths& widths,
                                    std::uint16_t* out) {
  const PositionCounts counts = countPositions(tile, kinds);
  StatedPositions stated(in, counts.stated, widths);
  in.require(counts.steps / kStepGroup <= in.left() / 2, "the bytes end too early");
  std::vector<std::uint16_t>& sums = DecodeScratch::here().sums;
  sums.resize(std::max(sums.size(), 4 * internal::sumsRoom(counts.steps)));
  std::fill_n(sums.begin(), 4, std::uint16_t{0});
  internal::sumSteps(in, counts.steps, sums.data());

  const std::uint16_t* sum = sums.data();  // up to the step before
  NarrowTriple p, all;                     // the current position; the union of all coordinates' bits
  const auto putStated = [&](std::uint32_t node) {
    p = NarrowTriple::of(stated.next());
    p.store(out + 3 * std::size_t{node});
  };
  const std::uint32_t strays = straysBegin(tile);
  for (std::uint32_t node = strays; node < tile.node_count_; ++node) putStated(node);
  for (std::uint32_t f = 0; f < kinds.size(); ++f) {
    if (kinds[f] == kLoose) continue;
    const Tile::Fragment& fragment = tile.fragments_[f];
    std::uint32_t node = fragment.child_node;
    const std::uint32_t end = node + (tile.fragmentEnd(f) - fragment.begin);
    if (kinds[f] == kLead) putStated(fragment.parent_node);
    if (standsAlone(tile, fragment)) {
      putStated(node++);
    } else if (kinds[f] == kLinked) {
      p = NarrowTriple::load(out + 3 * std::size_t{fragment.parent_node});
    }
    const NarrowTriple from = p - NarrowTriple::load(sum);
    for (; node < end; ++node) {
      sum += 4;
      const NarrowTriple at = from + NarrowTriple::load(sum);
      all.word |= at.word;
      at.store(out + 3 * std::size_t{node});
    }
  }
  // The last placed node's fourth number lies in the first stray.
  for (std::uint32_t node = strays; node < tile.node_count_; ++node)
    NarrowTriple::of(stated.at(node - strays)).store(out + 3 * std::size_t{node});
  requireWithin(in, {all.word & 0xffff, all.word >> 16 & 0xffff, all.word >> 32 & 0xffff}, widths);
}

void TileCodec::readPositions(ByteReader& in, Tile& tile, std::span<const Kind> kinds, const Widths& widths) {
  tile.offset_bits_ = *std::max_element(widths.begin(), widths.end());
  tile.fillOffsets([&](const auto& offsets) {
    if constexpr (std::endian::native == std::endian::little && sizeof(*offsets.at) == sizeof(std::uint16_t)) {
      readNarrowPositions(in, tile, kinds, widths, offsets.at);
    } else {
      readWidePositions(in, tile, kinds, widths, offsets);
    }
  });
  checkOnGrid(in, tile, widths);
}

void TileCodec::checkOnGrid(const ByteReader& in, const Tile& tile, const Widths& widths) {
  for (int axis = 0; axis < 3; ++axis) {
    const std::int64_t last = tile.origin_[axis] + (std::int64_t{1} << widths[static_cast<std::size_t>(axis)]) - 1;
    if (last < kGridEdge) continue;
    for (std::uint32_t n = 0; n < tile.node_count_; ++n)
      in.require(onGrid(tile.gridPoint(n)), "a position lies outside the grid");
  }
}

}  // namespace filiform
