#include "index/input/internal/folder_walk.h"

#include "index/errors.h"
#include "index/text.h"

#include <algorithm>
#include <cerrno>
#include <filesystem>
#include <functional>
#include <map>
#include <queue>
#include <set>
#include <sys/stat.h>
#include <system_error>
#include <utility>

namespace filiform::internal {
namespace {

namespace fs = std::filesystem;

using FileId = std::pair<dev_t, ino_t>;

// Of a path below the folder.
bool isClutter(std::string_view shown) {
  const auto has_part = [&](std::string_view begin) {
    return shown.starts_with(begin) || shown.find("/" + std::string(begin)) != std::string_view::npos;
  };
  return has_part("._") || has_part("__MACOSX/");
}

class FolderWalk {
 public:
  FolderWalk(const std::string& folder, bool (*wanted)(std::string_view), WalkDepth depth)
      : folder_(folder), wanted_(wanted), depth_(depth) {}

  std::vector<WalkedFile> run() {
    // Enters the lowest path first. A path is lower than all paths below it, so a folder is entered by its lowest path.
    open_.push("");
    while (!open_.empty()) {
      const std::string below = open_.top();
      open_.pop();
      enter(below);
    }
    std::sort(found_.begin(), found_.end(), [](const WalkedFile& a, const WalkedFile& b) { return a.shown < b.shown; });
    return std::move(found_);
  }

 private:
  void enter(const std::string& below) {
    const std::string path = below.empty() ? folder_ : (fs::path(folder_) / below).native();
    const std::string shown = below.empty() ? folder_ : below;
    struct stat status {};
    if (::stat(path.c_str(), &status) != 0) {
      refuse(path, shown, "cannot list the folder", errno);
      return;
    }
    if (!folders_.insert({status.st_dev, status.st_ino}).second) return;
    std::error_code error;
    for (fs::directory_iterator it(path, error), end; !error && it != end; it.increment(error)) {
      const std::string file_name = it->path().filename().native();
      look(*it, file_name, below.empty() ? file_name : below + '/' + file_name);
    }
    if (error) refuse(path, shown, "cannot list the folder", error.value());
  }

  void look(const fs::directory_entry& entry, const std::string& file_name, const std::string& shown) {
    const std::string& path = entry.path().native();
    const bool is_wanted = wanted_(file_name) && !isClutter(shown);
    std::error_code ignored;
    if (!is_wanted && entry.is_regular_file(ignored)) {
      found_.push_back({path, shown, {}, false});
      return;
    }
    if (!is_wanted && depth_ == WalkDepth::folder_only) return;
    struct stat status {};
    if (::stat(path.c_str(), &status) != 0) {
      const int error = errno;
      const bool is_link = entry.is_symlink(ignored);
      const bool maybe_folder = entry.is_directory(ignored) || (error != ELOOP && !fs::path(file_name).has_extension());
      if (!is_wanted && !maybe_folder)
        found_.push_back({path, shown, {}, false});
      else if (is_link && error == ENOENT)
        found_.push_back({path, shown, "a symbolic link to nothing"});
      else
        refuse(path, shown, "cannot read", error);
    } else if (S_ISDIR(status.st_mode)) {
      if (depth_ == WalkDepth::all) open_.push(shown);
    } else if (!is_wanted) {
      found_.push_back({path, shown, {}, false});
    } else if (!S_ISREG(status.st_mode)) {
      found_.push_back({path, shown, "neither a file nor a folder"});
    } else {
      const auto [known, is_new] = files_.try_emplace({status.st_dev, status.st_ino}, found_.size());
      if (is_new) {
        found_.push_back({path, shown, {}});
      } else if (shown < found_[known->second].shown) {
        found_[known->second] = {path, shown, {}};
      }
    }
  }

  void refuse(const std::string& path, const std::string& shown, const char* what, int error) {
    const IoError failure(inShort(path), what, error);
    if (failure.isShortage()) throw failure;
    found_.push_back({path, shown, failure.reason()});
  }

  const std::string& folder_;
  bool (*const wanted_)(std::string_view);
  const WalkDepth depth_;
  std::priority_queue<std::string, std::vector<std::string>, std::greater<>> open_;  // folders below folder_
  std::set<FileId> folders_;
  std::map<FileId, std::size_t> files_;  // index in found_
  std::vector<WalkedFile> found_;
};

}  // namespace

std::vector<WalkedFile> walkFolder(const std::string& folder, bool (*wanted)(std::string_view), WalkDepth depth) {
  return FolderWalk(folder, wanted, depth).run();
}

}  // namespace filiform::internal
