#include "index/formats/internal/graph_file.h"

#include "index/file/internal/byte_stream.h"
#include "index/formats/internal/catmaid_table.h"
#include "index/formats/internal/edge_list.h"
#include "index/formats/internal/graph_builder.h"
#include "index/formats/internal/mouselight.h"
#include "index/formats/internal/neurolucida.h"
#include "index/formats/internal/nml.h"
#include "index/formats/internal/obj_lines.h"
#include "index/formats/internal/vtk_polylines.h"
#include "index/formats/swc/internal/text_sniff.h"
#include "index/text.h"

namespace filiform {
namespace {

using internal::GraphBuilder;

void skipMark(internal::ByteStream& in, GraphBuilder& graph) {
  if (!in.head(3).starts_with("\xEF\xBB\xBF")) return;
  graph.remark(InputCode::W_BOM, 1, {});
  in.skip(3);
}

InputReport readStream(internal::ByteStream& in, std::string_view file, GraphFormat format, const GraphOptions& options,
                       Cell& cell) {
  SwcOptions units = options.units;
  if (format == GraphFormat::kNeuroglancerSkeleton || format == GraphFormat::kNml) {
    units.unit_um = 1;
    units.voxel_um.reset();
  }
  if (format == GraphFormat::kCatmaid && units.isMicrometres()) units.unit_um = 1e-3;  // nm
  GraphBuilder graph(units);
  const std::string_view head = in.head(4096);
  if (format == GraphFormat::kNeuroglancerSkeleton) {
    readSkeleton(in, options.skeleton, graph);
  } else if (internal::hasBinaryMagic(head)) {
    graph.refuse(InputCode::E_NOT_TEXT, 0, {});
  } else if (internal::isWideText(head)) {
    graph.refuse(InputCode::E_ENCODING, 0, {});
  } else {
    skipMark(in, graph);
    switch (format) {
      case GraphFormat::kEdgeList:
        readEdgeList(in, graph);
        break;
      case GraphFormat::kObjLines:
        readObjLines(in, graph);
        break;
      case GraphFormat::kNeurolucida:
        readNeurolucida(in, units.soma_links, graph);
        break;
      case GraphFormat::kMouseLight:
        readMouseLight(in, graph);
        break;
      case GraphFormat::kCatmaid:
        readCatmaid(in, graph);
        break;
      case GraphFormat::kNml:
        readNml(in, options.units, graph);
        break;
      default:
        readVtkPolylines(in, graph);
    }
  }
  InputReport report = graph.finish(file, cell);
  cell.digest = in.digest();
  return report;
}

}  // namespace

std::optional<GraphFormat> graphFormatOf(std::string_view file_name) {
  if (endsWithNoCase(file_name, ".edges")) return GraphFormat::kEdgeList;
  if (endsWithNoCase(file_name, ".obj")) return GraphFormat::kObjLines;
  if (endsWithNoCase(file_name, ".vtk")) return GraphFormat::kVtkPolylines;
  if (endsWithNoCase(file_name, ".asc")) return GraphFormat::kNeurolucida;
  return std::nullopt;
}

InputReport readGraphFile(const std::string& path, GraphFormat format, const GraphOptions& options, Cell& cell,
                          const std::function<void(std::uint64_t)>& progress) {
  internal::ByteStream in(path, progress);
  return readStream(in, path, format, options, cell);
}

InputReport readGraph(std::string_view bytes, std::string_view file, GraphFormat format, const GraphOptions& options,
                      Cell& cell) {
  internal::ByteStream in(bytes);
  return readStream(in, file, format, options, cell);
}

}  // namespace filiform
