#include "tools/commands/shared/colour_table.h"

#include "index/count_text.h"
#include "index/errors.h"
#include "index/set/tile_store.h"
#include "index/text.h"
#include "tools/program/interruption.h"

#include <cerrno>
#include <charconv>
#include <filesystem>
#include <fstream>
#include <iostream>
#include <optional>
#include <string_view>

namespace filiform::tools {
namespace {

std::optional<Rgba> colourOfText(std::string_view text) {
  if (text.size() != 7 || text[0] != '#') return std::nullopt;
  std::uint32_t value = 0;
  const auto [end, error] = std::from_chars(text.data() + 1, text.data() + 7, value, 16);
  if (error != std::errc() || end != text.data() + 7) return std::nullopt;
  const auto byte = [value](int shift) { return static_cast<std::uint8_t>(value >> shift); };
  return Rgba{byte(16), byte(8), byte(0)};
}

}  // namespace

std::shared_ptr<const CellColours> readColourTable(const TileStore& store, const std::string& path, Theme theme) {
  auto colours = std::make_shared<CellColours>();
  colours->unchosen = unchosenOn(theme);
  colours->of_cell.assign(store.cell_count(), Rgba{128, 128, 128});
  constexpr std::uintmax_t kMostBytes = std::uintmax_t{1} << 30;
  std::error_code error;
  const std::uintmax_t bytes = std::filesystem::file_size(path, error);
  if (error) throw IoError("--colour-table " + inShort(path), "cannot read", error.value());
  if (bytes > kMostBytes) throw InputError("--colour-table " + inShort(path) + ": more than 1 GiB; cut the table");
  std::ifstream in(path);
  if (!in) throw IoError("--colour-table " + inShort(path), "cannot open", errno);
  std::uint64_t lines = 0, coloured = 0, unknown = 0, odd = 0;
  std::string first_unknown, first_odd;
  for (std::string line; std::getline(in, line);) {
    throwIfInterrupted();
    if (line.ends_with('\r')) line.pop_back();
    if (lines == 0 && line.starts_with("\xEF\xBB\xBF")) line.erase(0, 3);
    if (line.empty()) continue;
    ++lines;
    const std::size_t tab = line.find('\t');
    const std::string name = line.substr(0, tab);
    std::string_view text = tab == std::string::npos ? std::string_view() : std::string_view(line).substr(tab + 1);
    text = text.substr(0, text.find('\t'));
    const auto colour = colourOfText(text);
    if (!colour) {
      if (lines > 1 && odd++ == 0) first_odd = line;
    } else if (const auto cell = store.findCell(name)) {
      colours->of_cell[*cell] = *colour;
      ++coloured;
    } else if (unknown++ == 0) {
      first_unknown = name;
    }
  }
  if (in.bad()) throw IoError("--colour-table " + inShort(path), "cannot read");
  std::string left;
  if (unknown > 0)
    left = "the set does not have " + formatCount(unknown) + " of the names, such as " + inShort(first_unknown);
  if (odd > 0)
    left += (left.empty() ? "" : "; ") + counted(odd, "line") + " without a colour, such as " + inShort(first_odd);
  if (coloured == 0)
    throw UsageError("--colour-table " + inShort(path) + ": no line colours a cell: give a name, a tab and #rrggbb" +
                     (left.empty() ? "" : "; " + left));
  if (!left.empty()) std::cerr << "filiform: note: --colour-table " << inShort(path) << ": " << left << '\n';
  return colours;
}

}  // namespace filiform::tools
