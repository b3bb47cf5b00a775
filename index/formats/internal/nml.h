// Reads the trees of KNOSSOS and webKnossos NML: XML with a `thing` a tree.
//
//   <things>
//     <parameters><scale x="11.24" y="11.24" z="28"/></parameters>
//     <thing id="1" name="axon">
//       <nodes><node id="1" radius="3" x="100" y="200" z="30"/><node id="2" x="110" y="200" z="30"/></nodes>
//       <edges><edge source="1" target="2"/></edges>
//     </thing>
//   </things>
//
// Positions are in voxels; `scale` gives the size of a voxel in nm, or in its `unit`. Radii are scaled by x. Edges are
// links, loops included. A file without a scale needs a unit of the options. `offset` is added only with
// `apply_offset`. Types are 0. Lines of records are the places of nodes or edges, from 1. Thread rule: pure functions,
// any thread.
#pragma once

#include "index/formats/swc.h"

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace filiform {

namespace internal {
class ByteStream;
class GraphBuilder;

struct NmlTree {
  std::string name;                               // of the thing; its id without one
  std::uint64_t at = 0, bytes = 0;                // in the file, up to the next element
  std::uint64_t comments = 0, branch_points = 0;  // on its nodes
};
struct NmlOutline {
  static constexpr std::uint64_t kMostBytes = std::uint64_t{1} << 28;

  std::string wrong;  // why this is no such file; empty if it is one
  std::uint64_t parameters_at = 0, parameters_bytes = 0;
  std::vector<NmlTree> trees;
};
// Lists the trees of a whole file. Entities other than those of XML are not expanded. Memory: at most eight times the
// text and 64 MiB.
NmlOutline outlineOfNml(std::string_view text);
// What a reader of one tree needs beside the parameters and the tree: the numbers of what is left out.
std::string leftOutOfNml(const NmlTree& tree);
}  // namespace internal

// Reads one tree: the element `parameters`, leftOutOfNml() and the element `thing`. `graph` expects um. graph_file.h
// states the errors.
void readNml(internal::ByteStream& in, const SwcOptions& options, internal::GraphBuilder& graph);

}  // namespace filiform
