#include "index/tile_codec.h"

#include "index/errors.h"
#include "index/memory_tiles.h"
#include "tests/support/random_cells.h"
#include "tests/support/tile_invariants.h"

#include <bit>
#include <random>

#include <gtest/gtest.h>

namespace filiform {
namespace {

TilePlace placeOf(const Tile& tile) { return {tile.id(), tile.key(), tile.isLong(), "file", 1000}; }

bool sameBits(const std::vector<float>& a, const std::vector<float>& b) {
  return std::equal(a.begin(), a.end(), b.begin(), b.end(), [](float x, float y) {
    return std::bit_cast<std::uint32_t>(x) == std::bit_cast<std::uint32_t>(y);
  });
}

std::vector<test::NamedCells> cases() {
  std::vector<test::NamedCells> all = test::worstCases();
  all.push_back({"column", test::randomColumn(21, 6, 300, 150)});
  return all;
}

TEST(TileCodec, DecodingGivesBackTheTile) {
  for (const test::NamedCells& named : cases()) {
    SCOPED_TRACE(named.name);
    test::VectorCellStream stream(named.cells);
    const auto store = buildTilesInMemory(stream, {.capacity = 50});
    for (TileId t = 0; t < store->tile_count(); ++t) {
      const auto tile = store->load(t);
      const std::vector<std::uint8_t> bytes = encodeTile(*tile);
      test::expectSameTile(decodeTile(bytes, placeOf(*tile), store->grid()), *tile);
      const TileAppearance appearance = store->loadAppearance(t);
      const std::vector<std::uint8_t> attributes = encodeAppearance(appearance);
      const TileAppearance again = decodeAppearance(attributes, placeOf(*tile), tile->segment_count());
      EXPECT_TRUE(sameBits(again.radii_um, appearance.radii_um));
      EXPECT_EQ(again.types, appearance.types);
    }
  }
}

TEST(TileCodec, RadiiKeepEveryBit) {
  TileAppearance appearance;
  for (std::uint32_t bits : {0u, 0x80000000u, 1u, 0x7f800000u, 0x7fc00000u, 0x7fc00001u, 0x3f800000u, 0x3f800000u}) {
    appearance.radii_um.push_back(std::bit_cast<float>(bits));
    appearance.types.push_back(static_cast<std::uint16_t>(bits));
  }
  for (int copies = 0; copies < 5; ++copies) {
    const auto bytes = encodeAppearance(appearance);
    const auto n = static_cast<std::uint32_t>(appearance.types.size());
    const TileAppearance again = decodeAppearance(bytes, {0, {}, false, "f", 0}, n);
    EXPECT_TRUE(sameBits(again.radii_um, appearance.radii_um));
    EXPECT_EQ(again.types, appearance.types);
    EXPECT_THROW(decodeAppearance(bytes, {0, {}, false, "f", 0}, n + 1), CorruptTile);
    const TileAppearance once = appearance;
    appearance.radii_um.insert(appearance.radii_um.end(), once.radii_um.begin(), once.radii_um.end());
    appearance.types.insert(appearance.types.end(), once.types.begin(), once.types.end());
  }
}

TEST(TileCodec, NeuritesTakeLessThanSevenBytesASegment) {
  const std::vector<Cell> cells = test::randomColumn(22, 10, 2000, 150);
  test::VectorCellStream stream(cells);
  const auto store = buildTilesInMemory(stream);
  std::size_t bytes = 0, segments = 0;
  for (TileId t = 0; t < store->tile_count(); ++t) {
    bytes += encodeTile(*store->load(t)).size();
    segments += store->entry(t).stored;
  }
  EXPECT_LT(static_cast<double>(bytes) / static_cast<double>(segments), 7.0);
}

// Without the checksum's help: any answer is allowed, except a crash, a read out of bounds (the sanitizers watch), or
// another error.
TEST(TileCodec, DamagedBytesNeverEscape) {
  test::VectorCellStream stream(test::randomColumn(23, 3, 200, 60));
  const auto store = buildTilesInMemory(stream, {.capacity = 100});
  std::mt19937_64 random(24);
  int refused = 0;
  for (TileId t = 0; t < store->tile_count(); ++t) {
    const auto tile = store->load(t);
    const std::vector<std::uint8_t> good = encodeTile(*tile), attributes = encodeAppearance(store->loadAppearance(t));
    const auto attempt = [&](const std::vector<std::uint8_t>& geometry, const std::vector<std::uint8_t>& appearance) {
      try {
        decodeTile(geometry, placeOf(*tile), store->grid());
        decodeAppearance(appearance, placeOf(*tile), tile->segment_count());
      } catch (const CorruptTile& error) {
        EXPECT_EQ(error.tile(), t);
        EXPECT_GE(error.offset(), 1000u);
        ++refused;
      }
    };
    for (int i = 0; i < 300; ++i) {
      std::vector<std::uint8_t> a = good, b = attributes;
      for (std::uint64_t flips = 1 + random() % 4; flips > 0; --flips) {
        a[random() % (random() % 2 ? a.size() : 40)] ^= static_cast<std::uint8_t>(1u << random() % 8);
        b[random() % b.size()] = static_cast<std::uint8_t>(random());
      }
      attempt(a, b);
      attempt(
          std::vector<std::uint8_t>(good.begin(), good.begin() + static_cast<std::ptrdiff_t>(random() % good.size())),
          attributes);
    }
  }
  EXPECT_GT(refused, 100);
}

TEST(TileCodec, RefusesWhatTheFormatCannotSay) {
  const GridPoint p(0, 0, 0), q(1, 0, 0);
  EXPECT_THROW(encodeTile(Tile(0, {}, false, Grid(), {{{0, 5}, 1, 0, p, q, true}})), InputError);
}

// The layout of FORMAT.md, byte by byte: this fails when the code drifts from it.
TEST(TileCodec, WritesTheSpecifiedBytes) {
  const GridPoint p0(10, 20, 30), p1(12, 20, 29), p2(12, 23, 29);
  const Tile tile(0, {}, false, Grid(), {{{3, 1}, 1, 0, p1, p0, true}, {{3, 2}, 2, 1, p2, p1, false}});
  const std::vector<std::uint8_t> expected{
      2,    1,                          // segments, fragments
      10,   0,    0,    0, 0, 0, 0, 0,  // lowest x
      20,   0,    0,    0, 0, 0, 0, 0,  // lowest y
      29,   0,    0,    0, 0, 0, 0, 0,  // lowest z
      3,    1,    2,    1,              // cell +3, first child 1, child - parent = 1 (zigzag 2), 2 samples
      2,    2,    1,                    // widths of starts: extents 2, 3, 1
      0,    0,    1,                    // start of the fragment: 0, 0, 1
      3,    3,    1,                    // widths of steps
      0x04, 0x30, 0x01,                 // x: 4, 0; y: 0, 6; z: 1, 0
      0x01,                             // owned: yes, no
  };
  EXPECT_EQ(encodeTile(tile), expected);
  TileAppearance appearance{{0.5f, 0.5f}, {3, 3}};
  EXPECT_EQ(encodeAppearance(appearance), (std::vector<std::uint8_t>{2, 3, 0, 1, 1, 0, 0, 0, 0x3f}));
}

}  // namespace
}  // namespace filiform
