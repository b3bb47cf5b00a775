#include "index/formats/internal/h5_morphology.h"

#include "index/cell/soma.h"
#include "index/file/internal/bytes.h"
#include "index/file/internal/digest.h"
#include "index/formats/internal/neurite_sections.h"

#include <algorithm>
#include <bit>
#include <utility>

namespace filiform::internal {

std::vector<std::string> listH5Morphologies(Hdf5Process& process, const std::string& file) {
  std::vector<std::string> names;
  process.ask("morphologies", file, {}, [&](hdf5::RecordKind kind, Hdf5Bytes bytes) {
    if (kind == hdf5::RecordKind::names) splitNames(bytes, [&](std::string_view name) { names.emplace_back(name); });
  });
  std::sort(names.begin(), names.end());
  names.erase(std::unique(names.begin(), names.end()), names.end());
  return names;
}

InputReport readH5Morphology(Hdf5Process& process, const std::string& file, const std::string& name,
                             const SwcOptions& options, const std::function<void(std::uint64_t)>& check, Cell& cell) {
  std::vector<std::array<double, 4>> points;
  std::vector<std::array<std::int64_t, 3>> structure;
  RunningDigest digest;
  process.ask("morphology", file, {name}, [&](hdf5::RecordKind kind, Hdf5Bytes bytes) {
    digest.add(bytes);
    ByteReader in(bytes);
    const auto rows = [&](auto& to, std::size_t columns) {
      while (in.left() > 0) {
        auto& row = to.emplace_back();
        for (std::size_t i = 0; i < columns; ++i)
          row[i] = std::bit_cast<typename std::decay_t<decltype(row)>::value_type>(in.u64());
      }
    };
    if (kind == hdf5::RecordKind::points) rows(points, 4);
    if (kind == hdf5::RecordKind::structure) rows(structure, 3);
    check(points.size() + structure.size());
  });
  InputReport report = h5Morphology(points, structure, file + "/" + name, options, cell);
  cell.digest = digest.value();
  return report;
}

InputReport h5Morphology(const std::vector<std::array<double, 4>>& points,
                         const std::vector<std::array<std::int64_t, 3>>& structure, std::string_view file,
                         const SwcOptions& options, Cell& cell) {
  GraphBuilder graph(options);
  NeuriteSections sections(graph, options.soma_links);
  const auto count = static_cast<std::int64_t>(points.size());
  const auto refuse = [&](std::size_t section, const std::string& why) {
    graph.refuse(InputCode::E_FORMAT, section + 1, "section " + std::to_string(section) + ": " + why);
  };
  std::vector<std::uint32_t> number(structure.size(), NeuriteSections::kNoSection);
  std::vector<SectionPoint> part;
  for (std::size_t s = 0; s < structure.size() && !graph.refused(); ++s) {
    const auto [first, type, parent] = structure[s];
    const std::int64_t end = s + 1 < structure.size() ? structure[s + 1][0] : count;
    if (first < 0 || first >= end || end > count) {
      refuse(s, "has no points");
    } else if (parent < -1 || parent >= static_cast<std::int64_t>(s)) {
      refuse(s, "its parent " + std::to_string(parent) + " is no section before it");
    } else {
      part.clear();
      for (std::int64_t i = first; i < end; ++i) {
        const auto& p = points[static_cast<std::size_t>(i)];
        part.push_back({{p[0], p[1], p[2]}, p[3] / 2, static_cast<std::uint64_t>(i) + 1});
      }
      if (type == kSomaType) {
        sections.soma(part);
        continue;
      }
      if (type < 0 || type > UINT16_MAX) graph.remark(InputCode::W_BAD_TYPE, static_cast<std::uint64_t>(first) + 1, "");
      number[s] = sections.section(parent < 0 ? NeuriteSections::kNoSection : number[static_cast<std::size_t>(parent)],
                                   type < 0 || type > UINT16_MAX ? 0 : static_cast<std::uint16_t>(type), part);
    }
  }
  if (!graph.refused() && !structure.empty() && structure[0][0] > 0) refuse(0, "points before it belong to no section");
  if (!graph.refused()) sections.finish();
  return graph.finish(file, cell);
}

}  // namespace filiform::internal
