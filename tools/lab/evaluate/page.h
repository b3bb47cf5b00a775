// A report as one HTML page that needs nothing else (pictures are inside it, no network), and as Markdown. Functions
// without state.
#pragma once

#include "tools/lab/bench/bench.h"

#include <string>
#include <utility>
#include <vector>

namespace filiform::tools {

struct PagePicture {
  std::string file;  // name of a PNG in the report's folder
  std::string caption;
};

struct PageFigure {
  std::string svg;  // an element of SvgCanvas
  std::string caption;
};

struct PageSection {
  std::string heading;
  std::vector<std::string> paragraphs;
  std::vector<BenchTable> tables;
  std::vector<PagePicture> pictures;
  std::vector<PageFigure> figures = {};  // on the HTML page only
};

// Light or dark as the reader has it, light on paper. Text is escaped. Throws IoError where a picture cannot be read.
std::string htmlPage(const std::string& title, const std::vector<PageSection>& sections, const std::string& folder);
std::string markdownPage(const std::string& title, const std::vector<PageSection>& sections);

}  // namespace filiform::tools
