// A report as one HTML page that needs nothing else (pictures are inside it, no network), and as Markdown. Functions
// without state.
#pragma once

#include "tools/bench/bench.h"

#include <string>
#include <utility>
#include <vector>

namespace filiform::tools {

struct PagePicture {
  std::string file;  // name of a PNG in the report's folder
  std::string caption;
};

struct PageSection {
  std::string heading;
  std::vector<std::string> paragraphs;
  std::vector<BenchTable> tables;
  std::vector<PagePicture> pictures;
};

// Text is escaped. Throws IoError where a picture cannot be read.
std::string htmlPage(const std::string& title, const std::vector<PageSection>& sections, const std::string& folder);
std::string markdownPage(const std::string& title, const std::vector<PageSection>& sections);

}  // namespace filiform::tools
