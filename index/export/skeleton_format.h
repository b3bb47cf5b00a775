// Neuroglancer precomputed skeletons of cells: the text of `info`, and the bytes of one skeleton.
// skeleton_properties.h has the text of `segment_properties/info`.
//
// Each skeleton is named by the cell's number (cell_numbers.h). Vertices are whole quanta from the centre of the
// bounds, as 32-bit floats. `transform` in `info` converts them to nm, exactly. `radius` is in quanta too, as the
// specification says; `vertex_types` are the types of the samples. Both are 32-bit floats, the only attributes that the
// released Neuroglancer (2.41.2) draws. Nodes are numbered by rank. Input reads the folder back with the same grid
// points, links and types. Thread rule: immutable.
#pragma once

#include "index/query/cell_graph.h"

#include <cstdint>
#include <iosfwd>
#include <optional>
#include <string>

namespace filiform {

// How the skeletons lie in shards, as `sharding` in `info` says (neuroglancer_uint64_sharded_v1). The number's
// MurmurHash3_x86_128 names minishard and shard. Minishard indices and skeletons are compressed with gzip.
struct SkeletonSharding {
  int minishard_bits = 0, shard_bits = 0;
};

class SkeletonFormat {
 public:
  // 32-bit floats hold whole numbers up to 2^24, so that bounds wider than 2^25 quanta (65 mm at the default quantum)
  // need rounding. refuse: throw InputError. round: write the nearest float, at most 2^-25 of the bounds' width away.
  enum class WideBounds { refuse, round };

  // Requires bounds that contain every cell. Throws InputError for bounds that `wide` refuses.
  SkeletonFormat(const Grid& grid, const GridBox& bounds, WideBounds wide = WideBounds::refuse);

  // Text of the file `info`. Without sharding, each skeleton is a file named by its number.
  std::string info(const std::optional<SkeletonSharding>& sharding = std::nullopt) const;
  // Writes one skeleton. Requires radii and types. Radii are 32-bit floats in quanta; a radius read back in um may
  // differ by a factor of 1e-7.
  void write(std::ostream& out, const CellGraph& cell) const;

 private:
  Grid grid_;
  GridPoint origin_;
};

}  // namespace filiform
