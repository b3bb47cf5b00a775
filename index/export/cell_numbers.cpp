#include "index/export/cell_numbers.h"

#include <charconv>
#include <string>
#include <string_view>

namespace filiform {

namespace {

// 0: the name is no such number.
std::uint64_t numberNamed(std::string_view name) {
  std::uint64_t number = 0;
  if (name.empty() || name.front() == '0') return 0;
  const auto [end, error] = std::from_chars(name.data(), name.data() + name.size(), number);
  return error == std::errc{} && end == name.data() + name.size() ? number : 0;
}

}  // namespace

CellNumbers::CellNumbers(const TileStore& store, const std::function<void()>& check) : store_(store) {
  for (std::uint32_t cell = 0; names_ && cell < store.cell_count(); ++cell) {
    if (check && cell % 256 == 0) check();
    const CellRecord& record = store.cell(cell);
    names_ = record.removed || numberNamed(record.name) != 0;
  }
}

std::uint64_t CellNumbers::of(std::uint32_t cell) const {
  return names_ ? numberNamed(store_.cell(cell).name) : std::uint64_t{cell} + 1;
}

std::optional<std::uint32_t> CellNumbers::find(std::uint64_t number) const {
  if (number == 0) return std::nullopt;
  if (names_) return store_.findCell(std::to_string(number));
  if (number > store_.cell_count()) return std::nullopt;
  const auto cell = static_cast<std::uint32_t>(number - 1);
  return store_.cell(cell).removed ? std::nullopt : std::optional(cell);
}

}  // namespace filiform
