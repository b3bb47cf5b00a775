// CellParts: the cells of a file that holds several.
//
//   const CellParts parts(whole);
//   for (std::size_t i = 0; i < parts.count(); ++i) use(parts.take(whole, i));
//
// A cell is all trees whose somata touch each other, if at least one of them has a neurite: many tracers draw one soma
// as several spheres. The other trees, and somata alone, are loose. Thread rule: immutable once made.
#pragma once

#include "index/cell/cell.h"

#include <cstddef>
#include <cstdint>
#include <vector>

namespace filiform {

class CellParts {
 public:
  // With more samples of somata, the file counts as one cell: it holds something other than cells.
  static constexpr std::size_t kMostSomaSamples = 10'000;

  // O(samples), and O(samples of somata squared) if all of them overlap in x.
  explicit CellParts(const Cell& whole);

  // Number of parts: 0 if `whole` is one cell; otherwise its cells, in the order of their first samples, and last the
  // loose trees, if there are any, as one part.
  std::size_t count() const { return starts_.empty() ? 0 : starts_.size() - 1; }
  std::size_t looseTrees() const { return loose_trees_; }

  // A part, with the samples in their order, the header and the attributes of `whole`. Its name is that of `whole`, or
  // what the source gives, and /1, /2 and so on, or /loose. Requires part < count(), and the cell of the constructor.
  // O(samples of the part).
  Cell take(const Cell& whole, std::size_t part) const;

 private:
  std::vector<std::uint32_t> ranks_;   // of `whole`, by part, ascending in each
  std::vector<std::size_t> starts_;    // of each part in ranks_, and the end
  std::vector<std::uint32_t> places_;  // by rank of `whole`: the rank in its part
  std::vector<std::uint32_t> parts_;   // by rank of `whole`
  std::size_t loose_trees_ = 0;
};

}  // namespace filiform
