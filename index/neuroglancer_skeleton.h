// Neuroglancer precomputed skeletons, unsharded: a folder with a JSON file `info` and one binary file an object, named
// by its id in decimal digits.
//
// A skeleton is u32 nodes, u32 links, float32 x y z a node, u32 pairs a link, then each attribute of the info in order,
// all little-endian. The info's 3x4 `transform` takes positions to nanometres. The attribute `radius`, one number a
// node, is in nanometres; `vertex_types`, as its writers use it, holds SWC type codes. A file that is not exactly as
// long as its counts say: E_FORMAT.
#pragma once

#include <array>
#include <cstddef>
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
  std::array<double, 12> transform_nm = {1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0};  // by row
  std::vector<Attribute> attributes;

  static constexpr std::size_t kMaxBytes = std::size_t{1} << 20;

  // Does the text say that it is the info of skeletons? False for anything else.
  static bool isSkeletonInfo(std::string_view json);
  // Throws InputError naming `file`: sharded skeletons, an unknown type of data, a transform that is none.
  static SkeletonInfo parse(std::string_view json, const std::string& file);
};

// See graph_file.h for what is thrown.
void readSkeleton(internal::ByteStream& in, const SkeletonInfo& info, internal::GraphBuilder& graph);

}  // namespace filiform
