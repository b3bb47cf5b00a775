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
  // Where each section ends: where the next one begins that does not begin before it. -1: a section without points.
  std::vector<std::int64_t> end(structure.size(), -1);
  std::int64_t covered = count;  // the first point of a section
  std::size_t last = structure.size();
  for (std::size_t s = 0; s < structure.size(); ++s) {
    const std::int64_t first = structure[s][0];
    if (first < 0 || first >= count || (last < s && first < structure[last][0])) continue;
    if (last < s)
      end[last] = first;
    else
      covered = first;
    end[s] = count;
    last = s;
  }
  for (std::int64_t i = 0; i < covered; ++i)
    graph.dropNode(InputCode::W_BAD_LINE, static_cast<std::uint64_t>(i) + 1, "of no section");
  std::vector<std::uint32_t> number(structure.size(),
                                    NeuriteSections::kNoSection);  // of a section or what it is part of
  std::vector<SectionPoint> part;
  for (std::size_t s = 0; s < structure.size(); ++s) {
    const auto [first, type, parent] = structure[s];
    const auto place = static_cast<std::uint64_t>(std::clamp<std::int64_t>(first, 0, count)) + 1;
    const std::string token = "section " + std::to_string(s);
    // No section: -1, other negative numbers, and -1 read as unsigned; the first section as its own parent.
    const bool root = parent < 0 || parent >= UINT32_MAX || (s == 0 && parent == 0);
    const bool known = !root && parent < static_cast<std::int64_t>(s);
    if (known) number[s] = number[static_cast<std::size_t>(parent)];
    if (first < 0 || first >= end[s]) {
      graph.remark(InputCode::W_ELEMENT, place, token + " has no points");
      continue;
    }
    part.clear();
    for (std::int64_t i = first; i < end[s]; ++i) {
      const auto& p = points[static_cast<std::size_t>(i)];
      part.push_back({{p[0], p[1], p[2]}, p[3] / 2, static_cast<std::uint64_t>(i) + 1});
    }
    if (type == kSomaType) {
      number[s] = NeuriteSections::kNoSection;
      sections.soma(part);
      continue;
    }
    if (!root && !known)
      graph.cutLink(InputCode::W_MISSING_PARENT, place, token + ", parent " + std::to_string(parent));
    const bool typed = type >= 0 && type <= UINT16_MAX;
    if (!typed) graph.remark(InputCode::W_BAD_TYPE, place, "");
    number[s] = sections.section(number[s], typed ? static_cast<std::uint16_t>(type) : 0, part);
  }
  sections.finish();
  return graph.finish(file, cell);
}

}  // namespace filiform::internal
