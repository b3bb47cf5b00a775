#include "tools/lab/evaluate/report/report_values.h"

#include "tools/pictures/png.h"

#include <algorithm>

namespace filiform::tools {

PlotSeries cumulative(const std::string& name, std::vector<double> values) {
  std::sort(values.begin(), values.end());
  PlotSeries series;
  series.name = name;
  for (std::size_t i = 0; i < values.size(); ++i) {
    series.x.push_back(values[i]);
    series.y.push_back(100.0 * static_cast<double>(i + 1) / static_cast<double>(values.size()));
  }
  return series;
}

void addPicture(PageSection& section, const Plot& plot, const std::string& folder, const std::string& file,
                const std::string& caption) {
  writePng(drawPlot(plot), folder + "/" + file);
  section.pictures.push_back({file, caption});
}

}  // namespace filiform::tools
