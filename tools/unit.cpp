#include "tools/unit.h"

#include "index/errors.h"
#include "index/text.h"
#include "tools/cli.h"

#include <algorithm>
#include <array>
#include <string_view>

namespace filiform::tools {

namespace {

double positive(double um, const std::string& whole) {
  if (!(um > 0))
    throw UsageError("--unit " + escaped(whole) +
                     ": give um, nm, mm, or the size of a voxel, such as 8nm, 0.5 (um) or 4,4,40");
  return um;
}

struct Unit {
  std::string_view name;
  double times, over;  // um = number * times / over, which rounds as the decimal number in um does
};
constexpr std::array<Unit, 3> kUnits = {{{"um", 1, 1}, {"nm", 1, 1e3}, {"mm", 1e3, 1}}};

double sizeOf(const std::string& part, const std::string& whole) {
  const auto unit = std::find_if(kUnits.begin(), kUnits.end(), [&](const Unit& u) { return part.ends_with(u.name); });
  if (unit == kUnits.end()) return positive(parseNumber("--unit", part), whole);
  const std::string number = part.substr(0, part.size() - unit->name.size());
  return positive((number.empty() ? 1 : parseNumber("--unit", number)) * unit->times / unit->over, whole);
}

}  // namespace

void readUnit(const std::string& text, SwcOptions& options) {
  const std::size_t first = text.find(','), second = first == std::string::npos ? first : text.find(',', first + 1);
  if (second == std::string::npos) {
    options.unit_um = sizeOf(text, text);
  } else {
    options.voxel_um =
        Vector3d(sizeOf(text.substr(0, first), text), sizeOf(text.substr(first + 1, second - first - 1), text),
                 sizeOf(text.substr(second + 1), text));
  }
}

}  // namespace filiform::tools
