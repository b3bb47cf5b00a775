#include "tools/serve/http/web_folder.h"

#include <cstdlib>
#include <filesystem>
#include <vector>

namespace filiform::tools {

namespace fs = std::filesystem;

std::string findWebFolder() {
  std::vector<fs::path> folders;
  std::error_code error;
  if (const char* const given = std::getenv("FILIFORM_WEB"); given != nullptr && *given != '\0') {
    folders.emplace_back(given);
  } else {
    const fs::path own = fs::read_symlink("/proc/self/exe", error).parent_path();
    folders = {own / ".." / "share" / "filiform" / "web", own / ".." / "web" / "page"};
  }
  for (const fs::path& folder : folders)
    if (fs::is_regular_file(folder / "filiform.wasm.gz", error)) return folder.string();
  return {};
}

}  // namespace filiform::tools
