#include "tools/pictures/legend.h"

#include "index/count_text.h"
#include "index/text.h"

#include <algorithm>
#include <string>

namespace filiform::tools {

Rgba inkOn(bool light) { return light ? kInk : Rgba{235, 238, 245}; }

double capitalOf(const PictureSize& size) { return std::clamp(size.height / 60.0, 7.0, 22.0); }

void drawLegend(Canvas& canvas, const PictureSize& size, const CellColours& colours, bool on_light) {
  if (colours.legend.empty()) return;
  const Rgba letters = inkOn(on_light), ground = on_light ? Rgba{255, 255, 255, 204} : Rgba{20, 23, 31, 204};
  const double capital = capitalOf(size), line = 1.9 * capital, rim = capital;
  const auto most = static_cast<std::size_t>(std::max(1.0, (size.height - 2 * rim) / line - 3));
  const std::size_t shown = std::min(colours.legend.size(), most);
  std::vector<std::string> lines{escaped(colours.attribute, 40) + (colours.unit.empty() ? "" : ", " + colours.unit)};
  for (std::size_t i = 0; i < shown; ++i)
    lines.push_back(escaped(colours.legend[i].value, 40) +
                    (colours.legend[i].cells == 0 ? "" : "  (" + counted(colours.legend[i].cells, "cell") + ")"));
  if (shown < colours.legend.size()) lines.push_back("and " + std::to_string(colours.legend.size() - shown) + " more");
  double widest = 0;
  for (const std::string& text : lines) widest = std::max(widest, canvas.textWidth(text, capital));
  canvas.fill(rim, rim, rim + widest + 4 * capital, rim + line * (static_cast<double>(lines.size()) + 0.6), ground);
  for (std::size_t i = 0; i < lines.size(); ++i) {
    const double base = rim + line * (static_cast<double>(i) + 1);
    const bool value = i > 0 && i <= shown;
    if (value) {
      const CellColours::Entry& entry = colours.legend[i - 1];
      canvas.fill(rim + capital, base - capital, rim + 2 * capital, base,
                  entry.chosen ? entry.colour : colours.unchosen);
    }
    canvas.text(lines[i], {rim + (value ? 2.8 : 1) * capital, base}, capital, letters);
  }
}

}  // namespace filiform::tools
