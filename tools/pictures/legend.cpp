#include "tools/pictures/legend.h"

#include "index/text.h"
#include "tools/pictures/canvas.h"

#include <algorithm>
#include <string>

namespace filiform::tools {

void drawLegend(Picture& picture, const CellColours& colours) {
  if (colours.legend.empty()) return;
  constexpr Rgba kLetters{235, 238, 245}, kBackground{20, 23, 31, 204};
  const double capital = std::clamp(picture.height / 60.0, 7.0, 22.0), line = 1.9 * capital, rim = capital;
  const auto most = static_cast<std::size_t>(std::max(1.0, (picture.height - 2 * rim) / line - 3));
  const std::size_t shown = std::min(colours.legend.size(), most);
  std::vector<std::string> lines{escaped(colours.attribute, 40) + (colours.unit.empty() ? "" : ", " + colours.unit)};
  for (std::size_t i = 0; i < shown; ++i)
    lines.push_back(escaped(colours.legend[i].value, 40) + "  (" + std::to_string(colours.legend[i].cells) +
                    (colours.legend[i].cells == 1 ? " cell)" : " cells)"));
  if (shown < colours.legend.size()) lines.push_back("and " + std::to_string(colours.legend.size() - shown) + " more");
  Canvas canvas(picture);
  double widest = 0;
  for (const std::string& text : lines) widest = std::max(widest, canvas.textWidth(text, capital));
  canvas.fill(rim, rim, rim + widest + 4 * capital, rim + line * (static_cast<double>(lines.size()) + 0.6),
              kBackground);
  for (std::size_t i = 0; i < lines.size(); ++i) {
    const double base = rim + line * (static_cast<double>(i) + 1);
    const bool value = i > 0 && i <= shown;
    if (value) {
      const CellColours::Entry& entry = colours.legend[i - 1];
      canvas.fill(rim + capital, base - capital, rim + 2 * capital, base,
                  entry.chosen ? entry.colour : colours.unchosen);
    }
    canvas.text(lines[i], {rim + (value ? 2.8 : 1) * capital, base}, capital, kLetters);
  }
}

}  // namespace filiform::tools
