#include "index/contacts/cell_copies.h"

#include "index/file/internal/sha256.h"
#include "index/query/cell_pass.h"

#include <algorithm>
#include <array>
#include <map>
#include <string>
#include <tuple>
#include <utility>

namespace filiform {
namespace {

// What equal cells have in common without reading them.
auto recordOutline(const CellRecord& r) {
  return std::tuple(r.samples, r.segments, r.isolated, r.roots, r.bounds.lo[0], r.bounds.lo[1], r.bounds.lo[2],
                    r.bounds.hi[0], r.bounds.hi[1], r.bounds.hi[2]);
}

std::string shapeDigest(const CellGraph& cell) {
  internal::Sha256 digest;
  const auto add = [&](const auto& values) {
    digest.add({reinterpret_cast<const std::uint8_t*>(values.data()), values.size() * sizeof(values[0])});
  };
  add(cell.positions);
  add(cell.parents);
  add(cell.links);
  return digest.value();
}

}  // namespace

std::vector<CellCopy> findCopies(const TileStore& store, const std::vector<std::uint32_t>& cells,
                                 std::uint64_t memory_bytes, unsigned threads, const std::function<void()>& check) {
  const auto outline = [&](std::uint32_t cell) { return recordOutline(store.cell(cell)); };
  std::vector<std::uint32_t> order = cells, read;
  std::erase_if(order, [&](std::uint32_t cell) { return store.cell(cell).samples == 0; });
  std::sort(order.begin(), order.end(), [&](std::uint32_t a, std::uint32_t b) { return outline(a) < outline(b); });
  for (std::size_t i = 0; i < order.size(); ++i)
    if ((i > 0 && outline(order[i - 1]) == outline(order[i])) ||
        (i + 1 < order.size() && outline(order[i + 1]) == outline(order[i])))
      read.push_back(order[i]);
  std::sort(read.begin(), read.end());
  std::map<std::string, std::uint32_t> first;  // by digest
  std::vector<CellCopy> copies;
  CellPass pass(store, read, {.memory_bytes = memory_bytes, .threads = threads, .check = check});
  for (const std::uint32_t cell : read) {
    const auto [at, is_first] = first.try_emplace(shapeDigest(pass.next()), cell);
    if (!is_first) copies.push_back({cell, at->second});
  }
  return copies;
}

}  // namespace filiform
