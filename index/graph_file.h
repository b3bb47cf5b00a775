// Graph files by the same door as SWC: nodes and straight links, loops kept. What each format gives and leaves out is
// in the header of its reader.
//
// The law is that of input_report.h: a node is kept iff its id and position are valid, a link iff both of its nodes are
// and differ; everything dropped or cut is one record. No file can make a reader take more memory than a fixed multiple
// of its own size. Pure functions, any thread.
#pragma once

#include "index/cell.h"
#include "index/input_report.h"
#include "index/neuroglancer_skeleton.h"
#include "index/swc.h"

#include <cstdint>
#include <functional>
#include <optional>
#include <string>
#include <string_view>

namespace filiform {

enum class GraphFormat : std::uint8_t { kEdgeList, kObjLines, kVtkPolylines, kNeuroglancerSkeleton };

// By the ending of a file's name, in any letter case: .edges, .obj, .vtk.
std::optional<GraphFormat> graphFormatOf(std::string_view file_name);

struct GraphOptions {
  SwcOptions units;       // `apply_offset` means nothing here
  SkeletonInfo skeleton;  // for kNeuroglancerSkeleton; its positions are in um by the info alone, whatever the units
};

// Fills `cell`: all but `source`; without samples if refused, the digest is set in any case. Sample ids are those of
// the file: of an edge list as they stand there, of OBJ from 1, of VTK and skeletons from 0. Lines of records are lines
// of text; in binary data the place of the node or link, from 1. `progress`, if any, is told the bytes of each block.
// Throws IoError naming `path`, what `progress` throws, UsageError for a unit, InputError beyond 2^32-2 nodes and
// links, ConservationError. O(bytes) expected.
InputReport readGraphFile(const std::string& path, GraphFormat format, const GraphOptions& options, Cell& cell,
                          const std::function<void(std::uint64_t bytes)>& progress = {});
// The same of bytes in memory; `file` is for messages.
InputReport readGraph(std::string_view bytes, std::string_view file, GraphFormat format, const GraphOptions& options,
                      Cell& cell);

}  // namespace filiform
