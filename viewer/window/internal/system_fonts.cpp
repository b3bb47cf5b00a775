#include "viewer/window/internal/system_fonts.h"

#include <cstdlib>
#include <map>
#include <sstream>
#include <string>
#include <system_error>

namespace filiform::internal {

namespace {

namespace fs = std::filesystem;

// In order of preference. The first has Latin, Greek, Cyrillic, arrows and mathematical signs.
constexpr const char* kText[] = {"DejaVuSans.ttf", "NotoSans-Regular.ttf", "LiberationSans-Regular.ttf", "FreeSans.ttf",
                                 "DroidSansFallbackFull.ttf"};
constexpr const char* kOthers[] = {"DejaVuSans.ttf",
                                   "NotoSans-Regular.ttf",
                                   "NotoSansCJK-Regular.ttc",
                                   "NotoSansSC-Regular.otf",
                                   "DroidSansFallbackFull.ttf",
                                   "DroidSansFallback.ttf",
                                   "wqy-microhei.ttc",
                                   "wqy-zenhei.ttc",
                                   "FreeSans.ttf",
                                   "unifont.ttf"};

std::string variable(const char* name) {
  const char* value = std::getenv(name);
  return value != nullptr ? value : "";
}

}  // namespace

std::vector<fs::path> fontFolders() {
  std::vector<fs::path> folders;
  const std::string home = variable("HOME"), own = variable("XDG_DATA_HOME");
  std::string shared = variable("XDG_DATA_DIRS");
  if (!own.empty())
    folders.push_back(fs::path(own) / "fonts");
  else if (!home.empty())
    folders.push_back(fs::path(home) / ".local/share/fonts");
  if (!home.empty()) folders.push_back(fs::path(home) / ".fonts");
  if (shared.empty()) shared = "/usr/local/share:/usr/share";
  std::istringstream in(shared);
  for (std::string folder; std::getline(in, folder, ':');)
    if (!folder.empty()) folders.push_back(fs::path(folder) / "fonts");
  return folders;
}

std::vector<fs::path> findFonts(const std::vector<fs::path>& folders) {
  std::map<std::string, fs::path> files;  // by name; the first folder's
  for (const fs::path& folder : folders) {
    std::error_code failure;
    fs::recursive_directory_iterator at(folder, fs::directory_options::skip_permission_denied, failure), end;
    for (; !failure && at != end; at.increment(failure))
      if (at->is_regular_file(failure)) files.emplace(at->path().filename().string(), at->path());
  }
  std::vector<fs::path> fonts;
  for (const char* name : kText)
    if (fonts.empty() && files.contains(name)) fonts.push_back(files.at(name));
  if (fonts.empty()) return fonts;
  for (const char* name : kOthers)
    if (files.contains(name) && files.at(name) != fonts.front()) fonts.push_back(files.at(name));
  return fonts;
}

}  // namespace filiform::internal
