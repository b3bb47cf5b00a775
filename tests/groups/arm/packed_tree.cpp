// Encodes and decodes random tiles, searches them by every path of the packed tree that this processor has, and
// compares with a scan of all segments. Prints a number that depends on every bit of every answer, so that processors
// can be compared.
#include "index/tile/packed_tree.h"

#include "index/tile/tile_codec.h"

#include <cstdio>
#include <random>

namespace {

using namespace filiform;

// A random walk with jumps. `step`: quanta; decides how many bits an offset takes.
std::vector<StoredSegment> walk(std::mt19937_64& random, std::uint32_t count, std::int64_t step) {
  std::vector<StoredSegment> segments;
  const auto moved = [&] {
    GridPoint by;
    for (std::int64_t& axis : by) axis = static_cast<std::int64_t>(random() % (2 * step + 1)) - step;
    return by;
  };
  std::uint32_t sample = 0;
  GridPoint at = moved();
  for (std::uint32_t i = 0; i < count; ++i) {
    if (random() % 16 == 0) {
      sample += 2;
      at = 8 * moved();
    }
    const GridPoint next = at + moved();
    segments.push_back({{0, sample + 1}, sample + 1, sample, next, at, true});
    at = next;
    ++sample;
  }
  return segments;
}

std::uint64_t mixed(std::uint64_t digest, const Candidate& c) {
  for (const double value : {c.squared_distance, c.t, c.p_W.x(), c.p_W.y(), c.p_W.z()}) {
    std::uint64_t bits;
    static_assert(sizeof bits == sizeof value);
    __builtin_memcpy(&bits, &value, sizeof bits);
    digest = (digest ^ bits) * 0x9E3779B97F4A7C15;
    digest ^= digest >> 29;
  }
  return digest ^ c.segment.key();
}

}  // namespace

int main() {
  std::mt19937_64 random(7);
  const Grid grid;
  std::uint64_t digest = 0, searches = 0;
  for (const std::int64_t step : {3, 200, 3000, 60000, 9000000}) {
    const std::vector<StoredSegment> segments = walk(random, 3000, step);
    const Tile whole(0, BlockKey{}, false, grid, segments);
    const TilePlace place{0, BlockKey{}, false, "tile", 0};
    const auto tile = std::make_shared<const Tile>(decodeTile(encodeTile(whole), place, grid));
    for (std::uint32_t n = 0; n < whole.node_count(); ++n)
      if (tile->gridPoint(n) != whole.gridPoint(n)) {
        std::fprintf(stderr, "a decoded tile has other positions: step %lld\n", static_cast<long long>(step));
        return 1;
      }
    for (int probe = 0; probe < 200; ++probe) {
      // Not by a distribution of the standard library, whose functions round as the processor's library does.
      const double size = grid.quantum_um() * static_cast<double>(step) * (1 << probe % 8);
      Vector3d h_W = tile->position_W(static_cast<std::uint32_t>(random() % tile->node_count()));
      for (double& coordinate : h_W) coordinate += size * (static_cast<double>(random() >> 11) * 0x1p-52 - 1);
      for (const std::size_t k : {1, 5}) {
        Candidates expected(k, 0, HUGE_VAL);
        for (std::uint32_t s = 0; s < tile->segment_count(); ++s)
          expected.offer(*tile, s, tile->position_W(tile->child(s)), tile->position_W(tile->parent(s)), h_W);
        for (const Candidate& c : expected.sorted()) digest = mixed(digest, c);
        for (const std::string& path : packedTreePaths()) {
          Candidates found(k, 0, HUGE_VAL);
          makePackedTree(tile, path)->search(h_W, found);
          std::uint64_t all = 0, wanted = 0;
          for (const Candidate& c : found.sorted()) all = mixed(all, c);
          for (const Candidate& c : expected.sorted()) wanted = mixed(wanted, c);
          if (all != wanted) {
            std::fprintf(stderr, "path %s differs from a scan: step %lld, probe %d, k %zu\n", path.c_str(),
                         static_cast<long long>(step), probe, k);
            return 1;
          }
          ++searches;
        }
      }
    }
  }
  std::printf("%016llx\n", static_cast<unsigned long long>(digest));
  std::fprintf(stderr, "%llu searches, paths:", static_cast<unsigned long long>(searches));
  for (const std::string& path : packedTreePaths()) std::fprintf(stderr, " %s", path.c_str());
  std::fprintf(stderr, "\n");
}
