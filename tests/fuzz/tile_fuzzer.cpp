#include "index/errors.h"
#include "index/tile/packed_tree.h"
#include "index/tile/tile_codec.h"
#include "tests/fuzz/fuzz_bytes.h"

namespace filiform::fuzz {
namespace {

constexpr const char* kFile = "fuzz.pack";

class Everywhere final : public Region {
 public:
  bool mayMeet(const WorldBox&) const noexcept override { return true; }
};

// Runs every query on a tile that a hand, a search or a picture makes.
void use(const std::shared_ptr<const Tile>& tile, const Vector3d& h_W) {
  const auto segments = tile->segment_count(), nodes = tile->node_count();
  for (std::uint32_t s = 0; s < segments; ++s) {
    const Tile::Link link = tile->link(s);
    require(link.child < nodes && link.parent < nodes, "a segment's ends are nodes");
    require(tile->child(s) == link.child && tile->parent(s) == link.parent, "one answer about a segment's ends");
    tile->findSegment(tile->segmentId(s));
    tile->owned(s);
  }
  for (std::uint32_t n = 0; n < nodes; ++n) {
    for (const std::uint32_t s : tile->incident(n)) require(s < segments, "what meets at a node are segments");
    tile->gridPoint(n);
    tile->nodeId(n);
    tile->isHome(n);
  }
  for (const std::string& path : packedTreePaths()) {
    const auto engine = makePackedTree(tile, path);
    Candidates best(3, 0, std::numeric_limits<double>::infinity());
    engine->search(h_W, best);
    std::vector<std::uint32_t> found;
    engine->collect(Everywhere(), found);
    require(found.size() == segments, "a region that holds all finds all");
  }
}

}  // namespace

// The input: flags, the grid, the place of the block, the number of owned segments of the appearance; then geometry or
// appearance.
void fuzzTile(Input input) {
  Taker in(input);
  const auto flags = in.number<std::uint8_t>();
  const auto depth = static_cast<int>(in.number<std::uint8_t>() % (kMortonBits + 1));
  const auto count = in.number<std::uint16_t>();
  const Grid grid(flags & 4 ? Grid::kMaxExponent : Grid::kDefaultExponent);
  const BlockKey key{depth == 0 ? MortonKey{0} : MortonKey{1} << (kMortonBits - depth), depth};
  const TilePlace place{7, key, (flags & 1) != 0, kFile, 1000};
  try {
    if (flags & 2) {
      const TileAppearance appearance = decodeAppearance(in.rest(), place, count);
      require(appearance.radii_um.size() == count && appearance.types.size() == count, "a look for each segment");
      const auto again = encodeAppearance(appearance);
      require(encodeAppearance(decodeAppearance(again, place, count)) == again, "a look survives its bytes");
      return;
    }
    const auto tile = std::make_shared<const Tile>(decodeTile(in.rest(), place, grid));
    use(tile, Vector3d(count, -1, 0.5));
    const auto bytes = encodeTile(*tile);
    require(encodeTile(decodeTile(bytes, place, grid)) == bytes, "a tile survives its bytes");
  } catch (const CorruptTile& error) {
    require(error.tile() == place.tile && error.file() == kFile && error.offset() >= place.offset &&
                error.offset() <= place.offset + in.rest().size() + 64,
            "damage is named by tile, file and offset");
  } catch (const InputError&) {
  }
}

}  // namespace filiform::fuzz
