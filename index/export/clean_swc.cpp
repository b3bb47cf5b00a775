#include "index/export/clean_swc.h"

#include "index/file/internal/decimals.h"

#include <array>
#include <charconv>
#include <ostream>
#include <string>

namespace filiform {

void writeCleanSwc(std::ostream& out, const Cell& cell) {
  if (!cell.header.empty()) out << cell.header << '\n';
  std::string line;
  std::array<char, 64> text;
  const auto put = [&](const char* end) {
    line.append(text.data(), static_cast<std::size_t>(end - text.data()));
    line += ' ';
  };
  const auto number = [&](auto value) { put(std::to_chars(text.data(), text.data() + text.size(), value).ptr); };
  auto odd = cell.odd_radii.begin();
  for (std::uint32_t rank = 0; rank < cell.samples(); ++rank) {
    line.clear();
    number(cell.sample_ids[rank]);
    number(cell.types[rank]);
    for (const double um : cell.positions_um[rank]) number(um);
    if (odd != cell.odd_radii.end() && odd->rank == rank)
      put(internal::putRadius(text.data(), odd++->radius_um));
    else
      put(internal::putRadius(text.data(), cell.radii_um[rank]));
    number(cell.parents[rank] == kNoParent ? std::int64_t{-1} : cell.sample_ids[cell.parents[rank]]);
    line.back() = '\n';
    out << line;
  }
}

}  // namespace filiform
