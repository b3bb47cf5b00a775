// What users say of the segments that a search considers. Thread rule: values.
#pragma once

#include "index/query/segment_filter.h"

#include <array>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

namespace filiform::tools {

// Types: words with `separator` between, ascending; empty for `any`. Throws UsageError, which names `option` and near
// names.
std::vector<std::uint16_t> parseSegmentTypes(const std::string& words, char separator, const std::string& option);

// `axon,dendrite`: the types of two sides, each as parseSegmentTypes() reads it with + between; one side stands for
// both. An empty text: all types. Throws UsageError as it does.
std::array<std::vector<std::uint16_t>, 2> parseTypesOfSides(const std::string& text, const std::string& option);

struct FilterParts {
  std::vector<std::uint32_t> cells{};               // empty: all; in any order, also in `not_cells`
  std::vector<std::uint32_t> not_cells{};           // these are left out
  std::optional<std::vector<std::uint32_t>> met{};  // the cells that meet conditions, ascending; nullopt: all
  std::vector<std::uint16_t> types{};               // empty: all
};

// What meets all parts. `cell_count`: of the set. O(cells) if cells are left out.
SegmentFilter filterOf(std::uint32_t cell_count, FilterParts parts);

}  // namespace filiform::tools
