// The nearest segments by looking at all of them: the oracle of every search.
#pragma once

#include "index/geometry/closest_point.h"
#include "index/tile/tile.h"
#include "index/tile/tile_engine.h"

#include <cstddef>
#include <vector>

namespace filiform::test {

struct BruteForceResult {
  double distance_um;
  SegmentId segment;
  double t;
  Vector3d p_W;
};

// The k nearest, best first, ties by id; each segment must be given once. O(n log n).
std::vector<BruteForceResult> bruteForceNearest(const std::vector<StoredSegment>& segments, const Grid& grid,
                                                const Vector3d& h_W, std::size_t k);

// All segments of a tile, as brute force wants them.
std::vector<StoredSegment> storedSegments(const Tile& tile);

// The engine's answers (k of 1, 5 and 50) are those of brute force over its tile's segments, to the last bit.
void expectBruteForce(const TileEngine& engine, const std::vector<StoredSegment>& segments, const Grid& grid,
                      const Vector3d& h_W);

}  // namespace filiform::test
