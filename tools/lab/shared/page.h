// Writes a report as one HTML page with its pictures inside (no network), and as Markdown. Functions without state.
#pragma once

#include "tools/lab/shared/bench_table.h"

#include <string>
#include <utility>
#include <vector>

namespace filiform::tools {

struct PagePicture {
  std::string file;  // name of a PNG in the report's folder
  std::string caption;
};

struct PageFigure {
  std::string svg;          // an SVG document
  std::string description;  // for readers who cannot see it
  std::string caption;
};

struct PageSection {
  std::string heading;
  std::vector<std::string> paragraphs;
  std::vector<BenchTable> tables;
  std::vector<PagePicture> pictures;
  std::vector<PageFigure> figures = {};  // shown on the HTML page only
};

// The page is light or dark as the reader's system prefers, and light on paper. Text is escaped. Throws IoError if a
// picture cannot be read.
std::string htmlPage(const std::string& title, const std::vector<PageSection>& sections, const std::string& folder);
std::string markdownPage(const std::string& title, const std::vector<PageSection>& sections);

}  // namespace filiform::tools
