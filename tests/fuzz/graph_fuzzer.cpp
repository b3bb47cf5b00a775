#include "index/errors.h"
#include "index/formats/internal/graph_file.h"
#include "index/formats/neuroglancer/internal/segment_properties.h"
#include "index/formats/neuroglancer/internal/spatial_index.h"
#include "tests/fuzz/fuzz_bytes.h"

#include <algorithm>
#include <set>
#include <string>
#include <vector>

namespace filiform::fuzz {

// The first byte is the format. For a skeleton, the info comes first, up to a zero byte.
void fuzzGraph(Input input) {
  Taker in(input);
  const auto format = static_cast<GraphFormat>(in.number<std::uint8_t>() % kGraphFormats);
  std::string_view bytes = asText(in.rest());
  GraphOptions options;
  if (format == GraphFormat::kNeuroglancerSkeleton) {
    const std::string_view info = bytes.substr(0, bytes.find('\0'));
    bytes.remove_prefix(std::min(bytes.size(), info.size() + 1));
    try {
      SkeletonInfo::isSkeletonInfo(info);
      options.skeleton = SkeletonInfo::parse(info, "info");
    } catch (const InputError&) {
    }
  }
  Cell cell;
  readGraph(bytes, "fuzz", format, options, cell);
  const std::size_t n = cell.samples();
  require(cell.positions_um.size() == n && cell.radii_um.size() == n && cell.types.size() == n, "arrays of one length");
  for (const Vector3d& p_W : cell.positions_um)
    require(p_W.allFinite() && p_W.cwiseAbs().maxCoeff() <= Grid::kMaxCoordinate_um, "positions lie in range");
  require(cell.isGraph() || cell.parents.size() == n, "a cell is a forest or has links");
  for (const auto& [child, parent] : cell.links) require(child < n && parent < n, "links are between samples");
  for (const std::uint32_t parent : cell.parents) require(parent == kNoParent || parent < n, "parents are samples");
}

// The info of segment properties, or of a volume; or a file of a spatial index, or an info that has one.
void fuzzProperties(Input input) {
  const std::string_view text = asText(input);
  try {
    SkeletonInfo::elsewhere(text, "info");
  } catch (const InputError&) {
  }
  const Box_nm box{{{0, 0, 0}, {9e3, 9e3, 9e3}}};
  try {
    std::vector<std::uint64_t> ids;
    SpatialIndex::objectsIn(box, text, "0-9.spatial", ids);
  } catch (const InputError&) {
  }
  try {
    const std::vector<std::string> names = SpatialIndex(text, "info", text, "info").filesIn(box);
    require(names.size() <= SpatialIndex::kMostFiles, "a box asks for a bounded number of files");
  } catch (const InputError&) {
  }
  try {
    const SegmentProperties properties(text, "info");
    require(std::is_sorted(properties.ids().begin(), properties.ids().end()), "ids ascend");
    for (const std::uint64_t id : properties.ids()) {
      Cell cell;
      properties.apply(id, cell);
      std::set<std::string> names;
      for (const CellAttribute& attribute : cell.attributes)
        require(names.insert(attribute.name).second && !isMissing(attribute.value), "each attribute has one value");
    }
  } catch (const InputError&) {
  }
}

}  // namespace filiform::fuzz
