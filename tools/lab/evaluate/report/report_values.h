// Small functions shared by the sections of an evaluation. Functions without state.
#pragma once

#include "tools/lab/shared/page.h"
#include "tools/pictures/plot.h"

#include <cstdint>
#include <string>
#include <vector>

namespace filiform::tools {

inline std::int64_t whole(std::uint64_t n) { return static_cast<std::int64_t>(n); }
inline std::string ratioText(std::uint64_t part, std::uint64_t of) {
  return std::to_string(part) + " of " + std::to_string(of);
}

// The percentage of values that are at most x, as a series over x.
PlotSeries cumulative(const std::string& name, std::vector<double> values);
// Draws the plot into the folder and adds it to the section. Throws IoError.
void addPicture(PageSection& section, const Plot& plot, const std::string& folder, const std::string& file,
                const std::string& caption);

}  // namespace filiform::tools
