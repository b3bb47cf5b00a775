// Reads Neuroglancer precomputed skeletons: a folder with a JSON file `info` and one binary file an object, named by
// the object's id in decimal digits; or with shards, which hold many objects (shard_scheme.h).
//
// A skeleton file is little-endian: u32 node count, u32 link count, float32 x y z for each node, a u32 pair for each
// link, then each attribute of the info in order. The info's 3x4 `transform` converts positions to nanometres. Of the
// attributes with one number a node, `radius` has the unit of the stored positions, and `vertex_types`, or without it
// `compartment`, holds SWC type codes. Each other attribute is left out (W_ATTRIBUTE, once a skeleton). A file whose
// length differs from its counts: E_FORMAT.
#pragma once

#include "index/formats/neuroglancer/internal/shard_scheme.h"

#include <array>
#include <cstddef>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace filiform {

namespace internal {
class ByteStream;
class GraphBuilder;
}  // namespace internal

struct SkeletonInfo {
  struct Attribute {
    enum class Type { kFloat32, kInt8, kUint8, kInt16, kUint16, kInt32, kUint32 } type = Type::kFloat32;
    std::size_t components = 1;
    std::string id;
  };
  std::array<double, 12> transform_nm = {1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0};  // row-major
  std::vector<Attribute> attributes;
  std::optional<ShardScheme> sharding;
  std::string segment_properties;  // folder below that of the info, with names and attributes (segment_properties.h);
                                   // empty: none

  static constexpr std::size_t kMaxBytes = std::size_t{1} << 20;

  // Nanometres of one unit of `radius`: the cube root of the volume that `transform_nm` gives to a unit cube. The
  // specification wants one scale for all axes. 0 for a transform that flattens.
  double radiusUnit_nm() const;
  // True if a file of `bytes` bytes that begins with the 8 bytes `head` is gzip data. A skeleton of 559903 nodes begins
  // like gzip data, but its counts state the size of the file.
  bool isGzip(std::string_view head, std::uint64_t bytes) const;

  // What the text of an `info` leads to if it is not that of skeletons.
  struct Elsewhere {
    std::string folder;                // with the skeletons of a volume, below that of the info; empty: there are none
    std::string segment_properties{};  // of the volume, as SkeletonInfo::segment_properties
    std::string what{};  // what the info describes, such as "an image volume, which has no skeletons"; empty: not known
  };
  // Throws InputError naming `file` for a folder that leads out of that of the info.
  static Elsewhere elsewhere(std::string_view json, const std::string& file);
  // True if the text is the `info` of skeletons.
  static bool isSkeletonInfo(std::string_view json);
  // Reads the text of `info`. Throws InputError naming `file` for an unknown data type or sharding, or an invalid
  // transform.
  static SkeletonInfo parse(std::string_view json, const std::string& file);
};

// Reads the whole input into `graph`. graph_file.h states the errors.
void readSkeleton(internal::ByteStream& in, const SkeletonInfo& info, internal::GraphBuilder& graph);

}  // namespace filiform
