#include "index/tile_source.h"

#include "index/errors.h"

#include <algorithm>
#include <cerrno>
#include <fcntl.h>
#include <map>
#include <mutex>
#include <sys/stat.h>
#include <unistd.h>

namespace filiform {
namespace {

class Folder final : public TileSource {
 public:
  explicit Folder(const std::string& path)
      : path_(path), folder_(::open(path.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC)) {
    if (folder_ < 0 && errno == ENOTDIR)
      throw IoError(path, "a file, and no tile set; make one of it with filiform ingest " + path + " -o NAME.fil");
    if (folder_ < 0) throw IoError(path, "cannot be opened", errno);
  }
  Folder(const Folder&) = delete;
  Folder& operator=(const Folder&) = delete;
  ~Folder() override {
    for (const auto& [name, file] : files_) ::close(file);
    ::close(folder_);
  }

  std::uint64_t size(const std::string& name) const override {
    struct stat status {};
    if (::fstat(file(name), &status) != 0) throw IoError(describe(name), "cannot be read", errno);
    return static_cast<std::uint64_t>(status.st_size);
  }

  void read(const std::string& name, std::uint64_t offset, std::span<std::uint8_t> bytes) const override {
    const int from = file(name);
    for (std::size_t done = 0; done < bytes.size();) {
      const ssize_t n = ::pread(from, bytes.data() + done, bytes.size() - done, static_cast<off_t>(offset + done));
      if (n < 0 && errno == EINTR) continue;
      if (n < 0) throw IoError(describe(name), "cannot be read", errno);
      if (n == 0) throw CorruptSet(describe(name), offset + done, "the file ends here");
      done += static_cast<std::size_t>(n);
    }
  }

  std::string describe(const std::string& name) const override { return path_ + "/" + name; }

 private:
  int file(const std::string& name) const {
    if (!isTileFileName(name)) throw UsageError("not the name of a file in a tile set");
    const std::lock_guard lock(mutex_);
    const auto found = files_.find(name);
    if (found != files_.end()) return found->second;
    const int opened = ::openat(folder_, name.c_str(), O_RDONLY | O_CLOEXEC);
    if (opened < 0) throw IoError(describe(name), "cannot be opened", errno);
    struct stat status {};
    if (::fstat(opened, &status) != 0 || !S_ISREG(status.st_mode)) {
      ::close(opened);
      throw IoError(describe(name), "is not a regular file");
    }
    return files_.emplace(name, opened).first->second;
  }

  std::string path_;
  int folder_;
  mutable std::mutex mutex_;
  mutable std::map<std::string, int> files_;
};

}  // namespace

bool isTileFileName(const std::string& name) {
  bool at_start = true;  // of a part
  for (char c : name) {
    const bool plain =
        (c >= 'A' && c <= 'Z') || (c >= 'a' && c <= 'z') || (c >= '0' && c <= '9') || c == '_' || c == '-';
    if (at_start ? !plain : !plain && c != '.' && c != '/') return false;
    at_start = c == '/';
  }
  return !at_start;
}

std::unique_ptr<TileSource> openFolder(const std::string& folder) { return std::make_unique<Folder>(folder); }

}  // namespace filiform
