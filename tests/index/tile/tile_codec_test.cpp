#include "index/tile/tile_codec.h"

#include "index/errors.h"
#include "index/ingest/memory_tiles.h"
#include "tests/support/scenes/random_cells.h"
#include "tests/support/scenes/test_graph.h"
#include "tests/support/scenes/tile_invariants.h"

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

std::vector<test::NamedCells> codecCases() {
  std::vector<test::NamedCells> all = test::worstCases();
  all.push_back({"column", test::randomColumn(21, 6, 300, 150)});
  return all;
}

TEST(TileCodec, DecodingGivesBackTheTile) {
  for (const test::NamedCells& named : codecCases()) {
    SCOPED_TRACE(named.name);
    CellList stream(named.cells);
    const auto store = buildTilesInMemory(stream, {.capacity = 50});
    for (TileId t = 0; t < store->tile_count(); ++t) {
      const auto tile = store->load(t);
      const std::vector<std::uint8_t> bytes = encodeTile(*tile);
      test::expectSameTile(decodeTile(bytes, placeOf(*tile), store->grid()), *tile);
      const TileAppearance appearance = store->loadAppearance(t);
      const std::vector<std::uint8_t> attributes = encodeAppearance(appearance);
      const TileAppearance again = decodeAppearance(attributes, placeOf(*tile), tile->owned_count());
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

TEST(TileCodec, RadiiReturnHoweverOftenTheyRepeat) {
  std::mt19937_64 random(27);
  std::vector<std::size_t> sizes;
  for (const unsigned distinct : {1u, 2u, 5u, 300u, 1u << 30})
    for (const unsigned run : {1u, 3u, 40u})
      for (const std::size_t n : {0u, 1u, 2u, 9u, 1000u}) {
        TileAppearance appearance;
        while (appearance.types.size() < n) {
          const auto radius = 0.001f * static_cast<float>(random() % distinct);
          for (std::size_t i = 1 + random() % run; i > 0 && appearance.types.size() < n; --i) {
            appearance.radii_um.push_back(radius);
            appearance.types.push_back(static_cast<std::uint16_t>(run));
          }
        }
        const auto bytes = encodeAppearance(appearance);
        const TileAppearance again =
            decodeAppearance(bytes, {0, {}, false, "f", 0}, static_cast<std::uint32_t>(appearance.types.size()));
        EXPECT_TRUE(sameBits(again.radii_um, appearance.radii_um)) << distinct << ", " << run << ", " << n;
        EXPECT_EQ(again.types, appearance.types);
        EXPECT_LE(bytes.size(), 4 * n + 10) << distinct << ", " << run << ", " << n;
      }
}

// Long segments are stored as ghosts at their ends, wherever their midpoint lies.
TEST(TileCodec, OwnershipReturnsWhereverTheMidpointLies) {
  std::mt19937_64 random(28);
  const BlockKey key{mortonKey({0, 0, 0}) >> 36 << 36, kMortonBits - 36};
  const GridBox block = key.box();
  for (const std::int64_t reach : {4, 1 << 6, 1 << 12, 1 << 24}) {  // edges of the block: each layout of positions
    std::vector<StoredSegment> segments;
    std::uint32_t owned = 0;
    for (std::uint32_t i = 0; i < 300; ++i) {
      const auto side = static_cast<std::uint64_t>(reach * ((block.hi - block.lo)[0] + 1));
      GridPoint a, b;
      for (int axis = 0; axis < 3; ++axis) {
        a[axis] = block.lo[axis] + static_cast<std::int64_t>(random() % side);
        b[axis] = 2 * block.lo[axis] - a[axis] + static_cast<std::int64_t>(random() % 10192) - 1000;
      }
      const bool inside = key.contains(mortonKey({(a.x() + b.x()) >> 1, (a.y() + b.y()) >> 1, (a.z() + b.z()) >> 1}));
      segments.push_back({{i, 1}, 1, 0, a, b, random() % 20 == 0 ? !inside : inside});
      owned += segments.back().owned ? 1 : 0;
    }
    const Tile tile(0, key, false, Grid(), segments);
    const Tile again = decodeTile(encodeTile(tile), placeOf(tile), Grid());
    test::expectSameTile(again, tile);
    for (std::uint32_t s = 0; s < again.segment_count(); ++s) EXPECT_EQ(again.owned(s), segments[s].owned);
    EXPECT_EQ(again.owned_count(), owned);
    EXPECT_TRUE(owned > 50 && owned < 250) << owned;
  }
}

TEST(TileCodec, NeuritesTakeLessThanSevenBytesASegment) {
  const std::vector<Cell> cells = test::randomColumn(22, 10, 2000, 150);
  CellList stream(cells);
  const auto store = buildTilesInMemory(stream);
  std::size_t bytes = 0, segments = 0;
  for (TileId t = 0; t < store->tile_count(); ++t) {
    bytes += encodeTile(*store->load(t)).size();
    segments += store->entry(t).stored;
  }
  EXPECT_LT(static_cast<double>(bytes) / static_cast<double>(segments), 7.0);
}

// Without the checksum, any result is allowed except a crash, a read out of bounds (the sanitizers check) or another
// error.
TEST(TileCodec, DamagedBytesNeverEscape) {
  CellList stream(test::randomColumn(23, 3, 200, 60));
  const auto store = buildTilesInMemory(stream, {.capacity = 100});
  std::mt19937_64 random(24);
  int refused = 0;
  for (TileId t = 0; t < store->tile_count(); ++t) {
    const auto tile = store->load(t);
    const std::vector<std::uint8_t> good = encodeTile(*tile), attributes = encodeAppearance(store->loadAppearance(t));
    const auto attempt = [&](const std::vector<std::uint8_t>& geometry, const std::vector<std::uint8_t>& appearance) {
      try {
        decodeTile(geometry, placeOf(*tile), store->grid());
        decodeAppearance(appearance, placeOf(*tile), tile->owned_count());
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

// Loops, several links with one child, and links whose ids differ from their children's: as one tile and as tiles of a
// partition.
TEST(TileCodec, DecodingGivesBackGraphs) {
  std::mt19937_64 random(25);
  for (int round = 0; round < 40; ++round) {
    const test::TestGraph graph = test::randomGraph(random, 20 + 10 * round, round % 2 == 0);
    const Tile whole(0, {}, false, graph.grid, graph.segments);
    test::expectSameTile(decodeTile(encodeTile(whole), placeOf(whole), graph.grid), whole);
    const test::TiledGraph tiles(graph, 30);
    for (TileId t = 0; t < tiles.tile_count(); ++t) {
      const Tile& tile = tiles.tile(t);
      test::expectSameTile(decodeTile(encodeTile(tile), placeOf(tile), graph.grid), tile);
    }
  }
}

TEST(TileCodec, DamagedGraphsNeverEscape) {
  std::mt19937_64 random(26);
  const test::TestGraph graph = test::randomGraph(random, 150, true);
  const Tile tile(0, {}, false, graph.grid, graph.segments);
  const std::vector<std::uint8_t> good = encodeTile(tile);
  int refused = 0;
  const auto attempt = [&](const std::vector<std::uint8_t>& bytes) {
    try {
      const Tile read = decodeTile(bytes, placeOf(tile), graph.grid);
      for (std::uint32_t n = 0; n < read.node_count(); ++n) {
        for (const std::uint32_t s : read.incident(n)) ASSERT_LT(s, read.segment_count());
        read.findNode(read.nodeId(n));
      }
      for (std::uint32_t s = 0; s < read.segment_count(); ++s) {
        ASSERT_LT(read.child(s), read.node_count());
        ASSERT_LT(read.parent(s), read.node_count());
      }
    } catch (const CorruptTile&) {
      ++refused;
    }
  };
  for (std::size_t i = 0; i < good.size(); ++i) {
    std::vector<std::uint8_t> bytes = good;
    bytes[i] ^= static_cast<std::uint8_t>(1u << random() % 8);
    attempt(bytes);
    attempt(std::vector<std::uint8_t>(good.begin(), good.begin() + static_cast<std::ptrdiff_t>(i)));
  }
  EXPECT_GE(refused, static_cast<int>(good.size()));  // every truncation, and more
}

TEST(TileCodec, RefusesPositionsOutsideTheGrid) {
  const std::int64_t edge = std::int64_t{1} << 41;
  const GridPoint p(0, 0, 0), q(edge, 0, 0);
  EXPECT_THROW(encodeTile(Tile(0, {}, false, Grid(), std::vector<StoredSegment>{{{0, 1}, 1, 0, q, p, true}})),
               InputError);
}

// The layout of FORMAT.md, byte by byte: fails if the code differs from it.
TEST(TileCodec, WritesTheSpecifiedBytes) {
  const GridPoint p0(10, 20, 30), p1(12, 20, 29), p2(12, 23, 29);
  const Tile tile(0, {}, false, Grid(),
                  std::vector<StoredSegment>{{{3, 1}, 1, 0, p1, p0, true}, {{3, 2}, 2, 1, p2, p1, false}});
  const std::vector<std::uint8_t> expected{
      0,    2,    1,    0,              // no graph; segments, fragments, strays
      10,   0,    0,    0, 0, 0, 0, 0,  // lowest x
      20,   0,    0,    0, 0, 0, 0, 0,  // lowest y
      29,   0,    0,    0, 0, 0, 0, 0,  // lowest z
      2,    2,    1,                    // widths: extents 2, 3, 1
      4,    3,    1,                    // two segments after a lead; cell +3; first rank 1
      0,    0,    1,                    // position of the lead
      0x63, 0x04,                       // widths of steps: 3, 3, 1
      0x04, 0x30, 0x01,                 // x: 4, 0; y: 0, 6; z: 1, 0
      1,    1,                          // not owned though its midpoint lies in the block: segment 1; one group of runs
  };
  EXPECT_EQ(encodeTile(tile), expected);
  TileAppearance appearance{{0.5f, 0.5f}, {3, 3}};
  EXPECT_EQ(encodeAppearance(appearance), (std::vector<std::uint8_t>{2, 3, 0, 1, 1, 0, 0, 0, 0, 0x3f}));
}

// A graph: two links have child 1 and one closes a loop; an isolated sample in another cell.
TEST(TileCodec, WritesTheSpecifiedBytesOfAGraph) {
  const GridPoint p0(0, 0, 0), p1(4, 0, 0), p2(4, 4, 0), q(0, 0, 0);
  const Tile tile(0, {}, false, Grid(),
                  std::vector<StoredSegment>{{{0, 0}, 1, 0, p1, p0, true},
                                             {{0, 1}, 2, 1, p2, p1, true},
                                             {{0, 2}, 1, 0, p1, p0, true},
                                             {{1, 0}, 0, 0, q, q, true}});
  const std::vector<std::uint8_t> expected{
      1,    4,    3, 0,              // a graph; segments, fragments, strays
      0,    0,    0, 0, 0, 0, 0, 0,  // lowest x
      0,    0,    0, 0, 0, 0, 0, 0,  // lowest y
      0,    0,    0, 0, 0, 0, 0, 0,  // lowest z
      3,    3,    0,                 // widths: extents 4, 4, 0
      4,    0,    0, 1,              // two segments after a lead, cell 0, rank 0; first sample 0 - (-1)
      3,    0,    0, 2, 4, 6,        // loose, rank 2; first sample 2 - 1; child node 3 - 2, parent node 3 - 3
      2,    1,    0, 0,              // a sample alone in cell 1, rank 0, sample 0
      0x00, 0x00,                    // x, y of the lead and of the sample alone; z takes no bits
      0x84, 0x00,                    // widths of steps: 4, 4, 0
      0x08, 0x80,                    // x: 8, 0; y: 0, 8
      0,                             // all owned, as their midpoints say; one group of runs
  };
  EXPECT_EQ(encodeTile(tile), expected);
}

}  // namespace
}  // namespace filiform
