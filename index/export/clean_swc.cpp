#include "index/export/clean_swc.h"

#include "index/file/internal/decimals.h"

#include <array>
#include <charconv>
#include <ostream>

namespace filiform {

void writeCleanSwc(std::ostream& out, const Cell& cell) {
  if (!cell.header.empty()) out << cell.header << '\n';
  std::array<char, 512> line;
  auto odd = cell.odd_radii.begin();
  for (std::uint32_t rank = 0; rank < cell.samples(); ++rank) {
    char* at = line.data();
    const auto whole = [&](auto value) {
      at = std::to_chars(at, line.data() + line.size(), value).ptr;
      *at++ = ' ';
    };
    whole(cell.sample_ids[rank]);
    whole(cell.types[rank]);
    for (const double um : cell.positions_um[rank]) whole(um);
    if (odd != cell.odd_radii.end() && odd->rank == rank)
      at = internal::putRadius(at, odd++->radius_um);
    else
      at = internal::putRadius(at, cell.radii_um[rank]);
    *at++ = ' ';
    whole(cell.parents[rank] == kNoParent ? std::int64_t{-1} : cell.sample_ids[cell.parents[rank]]);
    at[-1] = '\n';
    out.write(line.data(), at - line.data());
  }
}

}  // namespace filiform
