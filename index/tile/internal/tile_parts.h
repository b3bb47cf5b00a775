// TileCodec: reads and writes the geometry and topology of a tile (encodeTile(), decodeTile()). It knows the members of
// Tile. Thread rule: functions without state.
#pragma once

#include "index/file/internal/bytes.h"
#include "index/tile/tile.h"
#include "index/tile/tile_place.h"

#include <array>
#include <cstdint>
#include <span>
#include <utility>
#include <vector>

namespace filiform {

class TileCodec {
 public:
  static std::vector<std::uint8_t> encode(const Tile& tile);
  // Throws Damage.
  static Tile decode(internal::ByteReader& in, const TilePlace& place, const Grid& grid);

 private:
  // How a fragment starts.
  enum Kind : std::uint32_t {
    kLead = 0,    // its first parent is the sample before, placed just before its first child
    kLinked = 1,  // its first parent is another node
    kSelf = 2,    // its first parent is its first child: an isolated sample
    kLoose = 3,   // graphs: one segment between nodes that are placed elsewhere
  };
  static Kind kindOf(const Tile& tile, std::uint32_t f) {
    const Tile::Fragment& fragment = tile.fragments_[f];
    if (!tile.places(f)) return kLoose;
    if (fragment.parent_node == fragment.child_node) return kSelf;
    return tile.hasLead(f) ? kLead : kLinked;
  }
  static std::uint32_t straysBegin(const Tile& tile) {
    return tile.node_count_ - static_cast<std::uint32_t>(tile.strays_.size());
  }
  // True if the first child's position is stored directly. Otherwise it is a step from a parent stored earlier.
  static bool standsAlone(const Tile& tile, const Tile::Fragment& f) {
    return f.parent_node >= f.child_node && f.parent_node < straysBegin(tile);
  }
  static constexpr std::int64_t kGridEdge = std::int64_t{1} << (kMortonAxisBits - 1);
  static bool onGrid(const GridPoint& p) { return (p.array() >= -kGridEdge).all() && (p.array() < kGridEdge).all(); }

  using Widths = std::array<int, 3>;  // bits of a coordinate, by axis

  // Which positions are stored directly and which as steps, in the order of the fragments.
  struct PositionOrder {
    std::vector<std::uint32_t> stated;
    std::vector<std::pair<std::uint32_t, std::uint32_t>> steps;  // (node, from)
  };
  static void writeFragments(const Tile& tile, bool graph, internal::ByteWriter& out, PositionOrder& order);
  static void writeStrays(const Tile& tile, internal::ByteWriter& out);
  static void writePositions(const Tile& tile, const PositionOrder& order, const Widths& widths,
                             internal::ByteWriter& out);
  static void writeOwned(const Tile& tile, internal::ByteWriter& out);
  static void writeRuns(const Tile& tile, internal::ByteWriter& out);

  // What the list of fragments states.
  struct Fragments {
    struct Ends {  // zigzag steps to nodes; known when all nodes are counted
      std::uint32_t fragment;
      std::uint64_t child, parent;
    };
    std::vector<Kind> kinds;            // by fragment
    std::vector<std::uint32_t> strips;  // first node of each fragment that places nodes
    std::vector<Ends> ends;
    std::uint32_t nodes = 0;  // that the fragments place
  };
  static Fragments readFragments(internal::ByteReader& in, Tile& tile, std::uint32_t fragment_count, bool graph);
  static void readEnds(const internal::ByteReader& in, Tile& tile, const Fragments& fragments);
  static void readStrays(internal::ByteReader& in, Tile& tile, std::uint32_t stray_count);
  // Fills the tile's offsets. Throws Damage if a position lies outside the tile or the grid.
  static void readPositions(internal::ByteReader& in, Tile& tile, std::span<const Kind> kinds, const Widths& widths);
  struct PositionCounts {
    std::size_t stated, steps;
  };
  static PositionCounts countPositions(const Tile& tile, std::span<const Kind> kinds);
  template <class Offsets>
  static void readWidePositions(internal::ByteReader& in, const Tile& tile, std::span<const Kind> kinds,
                                const Widths& widths, const Offsets& out);
  static void readNarrowPositions(internal::ByteReader& in, const Tile& tile, std::span<const Kind> kinds,
                                  const Widths& widths, std::uint16_t* out);
  static void checkOnGrid(const internal::ByteReader& in, const Tile& tile, const Widths& widths);
  static std::vector<std::uint32_t> readOwned(internal::ByteReader& in, const Tile& tile);
  static void readRuns(internal::ByteReader& in, Tile& tile);
};

}  // namespace filiform
