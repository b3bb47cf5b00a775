// Finds the nearest segments by testing all of them: the oracle of every search.
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

// Returns the k nearest, best first, ties by id. Each segment must be given once. O(n log n).
std::vector<BruteForceResult> bruteForceNearest(const std::vector<StoredSegment>& segments, const Grid& grid,
                                                const Vector3d& h_W, std::size_t k);

// All segments of a tile, in the form for brute force.
std::vector<StoredSegment> storedSegments(const Tile& tile);

// Expects that the engine's results (k of 1, 5 and 50) equal brute force over its tile's segments, to the last bit.
void expectBruteForce(const TileEngine& engine, const std::vector<StoredSegment>& segments, const Grid& grid,
                      const Vector3d& h_W);

}  // namespace filiform::test
