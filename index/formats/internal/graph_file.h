// Reads graph files into a Cell: nodes and straight links, loops included. The header of each format's reader states
// what that format holds.
//
// The rule is that of input_report.h. A node is kept if and only if its id and position are valid. A link is kept if
// and only if both of its nodes are kept and differ. Each dropped node and each cut link is one record. A reader takes
// at most a fixed multiple of the file's size as memory. Thread rule: pure functions, any thread.
#pragma once

#include "index/cell/cell.h"
#include "index/formats/internal/neuroglancer_skeleton.h"
#include "index/formats/swc.h"
#include "index/reports/input_report.h"

#include <cstdint>
#include <functional>
#include <optional>
#include <string>
#include <string_view>

namespace filiform {

enum class GraphFormat : std::uint8_t {
  kEdgeList,
  kObjLines,
  kVtkPolylines,
  kNeuroglancerSkeleton,
  kNeurolucida,
  kMouseLight,
  kCatmaid,
  kNml
};
inline constexpr unsigned kGraphFormats = 8;

// The format by the ending of a file name, in any letter case: .edges, .obj, .vtk, .asc. nullopt for any other ending.
// Files of MouseLight, CATMAID and NML hold several cells (mouselight_file.h, catmaid_file.h, nml_file.h); the formats
// are those of one of them.
std::optional<GraphFormat> graphFormatOf(std::string_view file_name);

struct GraphOptions {
  SwcOptions units;       // `apply_offset` is for NML only
  SkeletonInfo skeleton;  // for kNeuroglancerSkeleton: gives positions in um; `units` is then ignored
};

// Reads a file into `cell`: all members except `source`. If the file is refused, `cell` has a digest but no samples.
//
// Sample ids: an edge list keeps its own; OBJ and ASC count from 1; VTK and skeletons count from 0; mouselight.h states
// those of MouseLight. Lines of records are text lines; in binary data, the position of the node or link from 1.
// `progress` receives the size of each block read.
//
// Throws IoError naming `path`, UsageError for a bad unit, InputError for more than 2^32-2 nodes and links,
// ConservationError, and what `progress` throws. O(bytes) expected.
InputReport readGraphFile(const std::string& path, GraphFormat format, const GraphOptions& options, Cell& cell,
                          const std::function<void(std::uint64_t bytes)>& progress = {});
// Like readGraphFile(), for bytes in memory. Error messages name `file`.
InputReport readGraph(std::string_view bytes, std::string_view file, GraphFormat format, const GraphOptions& options,
                      Cell& cell);

}  // namespace filiform
