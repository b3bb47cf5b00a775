#include "tools/words/unit.h"

#include "index/errors.h"
#include "index/text.h"

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <optional>
#include <string_view>
#include <utility>
#include <vector>

namespace filiform::tools {

namespace {

// The unit in um, as a product (mm) or a quotient (nm). The quotient gives the double nearest to the decimal number.
struct Unit {
  double times = 1, over = 1;
};

constexpr std::array<std::pair<std::string_view, Unit>, 5> kLengthUnits{
    {{"um", {1, 1}}, {"\u00B5m", {1, 1}}, {"\u03BCm", {1, 1}}, {"nm", {1, 1000}}, {"mm", {1000, 1}}}};

// Removes a unit, and the blanks before it, from the end of the text.
std::optional<Unit> takeUnit(std::string_view& text) {
  for (const auto& [name, unit] : kLengthUnits) {
    if (!text.ends_with(name)) continue;
    text.remove_suffix(name.size());
    while (text.ends_with(' ')) text.remove_suffix(1);
    return unit;
  }
  return std::nullopt;
}

[[noreturn]] void refuse(const std::string& text) {
  throw UsageError("--unit " + inShort(text) +
                   ": give um, nm or mm, or the size of a voxel, such as 8nm or 0.5um, or its sizes along x, y and z, "
                   "such as 8,8,30nm; a number without a unit is in um");
}

}  // namespace

void readUnit(const std::string& text, SwcOptions& options) {
  std::vector<std::string_view> parts;
  for (std::size_t begin = 0; begin <= text.size();) {
    const std::size_t end = std::min(text.find(',', begin), text.size());
    parts.push_back(std::string_view(text).substr(begin, end - begin));
    begin = end + 1;
  }
  if (parts.size() != 1 && parts.size() != 3) refuse(text);
  std::vector<std::optional<Unit>> units;
  for (std::string_view& part : parts) units.push_back(takeUnit(part));
  std::vector<double> sizes_um;
  for (std::size_t i = 0; i < parts.size(); ++i) {
    const Unit unit = units[i].value_or(units.back().value_or(Unit{}));
    double size = 1;  // for a unit without a number
    if (!parts[i].empty() || !units[i] || parts.size() > 1) {
      const auto [rest, error] = std::from_chars(parts[i].data(), parts[i].data() + parts[i].size(), size);
      if (error != std::errc() || rest != parts[i].data() + parts[i].size()) refuse(text);
    }
    size = size * unit.times / unit.over;
    if (!std::isfinite(size) || !(size > 0)) refuse(text);
    sizes_um.push_back(size);
  }
  if (sizes_um.size() == 1) {
    options.unit_um = sizes_um[0];
  } else {
    options.voxel_um = Vector3d(sizes_um[0], sizes_um[1], sizes_um[2]);
  }
}

}  // namespace filiform::tools
