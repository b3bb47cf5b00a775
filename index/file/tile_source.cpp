#include "index/file/tile_source.h"

#include "index/count_text.h"
#include "index/errors.h"
#include "index/internal/descriptor.h"

#include <algorithm>
#include <cerrno>
#include <fcntl.h>
#include <list>
#include <map>
#include <memory>
#include <mutex>
#include <optional>
#include <sys/resource.h>
#include <sys/stat.h>
#include <utility>

namespace filiform {
namespace {

using internal::Descriptor;

std::size_t mostOpenByDefault() {
  struct rlimit limit {};
  if (::getrlimit(RLIMIT_NOFILE, &limit) != 0 || limit.rlim_cur == RLIM_INFINITY) return 512;
  return std::max<std::size_t>(1, static_cast<std::size_t>(limit.rlim_cur / 2));
}

class Folder final : public TileSource {
 public:
  Folder(const std::string& path, std::size_t most_open)
      : path_(path),
        most_open_(most_open > 0 ? most_open : mostOpenByDefault()),
        root_(std::make_shared<Descriptor>(::open(path.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC))) {
    if (!root_->isOpen() && errno == ENOTDIR)
      throw IoError(path,
                    "is a file, not a tile set; make a tile set from it with filiform ingest " + path + " -o NAME.fil");
    if (!root_->isOpen()) throw IoError(path, "cannot be opened", errno);
  }

  std::uint64_t size(const std::string& name) const override {
    struct stat status {};
    if (::fstat(file(name)->number(), &status) != 0) throw IoError(describe(name), "cannot be read", errno);
    return static_cast<std::uint64_t>(status.st_size);
  }

  void read(const std::string& name, std::uint64_t offset, std::span<std::uint8_t> bytes) const override {
    const std::shared_ptr<const Descriptor> from = file(name);  // keeps the file open during the read
    const std::optional<std::size_t> n = from->readAt(offset, bytes.data(), bytes.size());
    if (!n) throw IoError(describe(name), "cannot be read", errno);
    if (*n < bytes.size()) throw CorruptSet(describe(name), offset + *n, "the file ends here");
  }

  void expect(const std::string& name, std::uint64_t bytes) const override {
    const std::uint64_t found = size(name);
    if (found != bytes)
      throw CorruptSet(describe(name), std::min(found, bytes),
                       "has " + counted(found, "byte") + ", the manifest says " + formatCount(bytes));
  }

  std::string describe(const std::string& name) const override { return path_ + "/" + name; }

 private:
  struct File {
    dev_t device;
    ino_t inode;
    std::shared_ptr<const Descriptor> open;  // nullptr while closed
    std::list<File*>::iterator recent;       // valid while open
  };

  std::shared_ptr<const Descriptor> file(const std::string& name) const {
    if (!isTileFileName(name)) throw UsageError("not the name of a file in a tile set");
    bool seen_before = false;
    {
      const std::lock_guard lock(mutex_);
      const auto found = files_.find(name);
      seen_before = found != files_.end();
      if (seen_before && found->second.open != nullptr) {
        recent_.splice(recent_.begin(), recent_, found->second.recent);
        return found->second.open;
      }
    }
    // Without the lock, since the disk may be slow.
    const std::shared_ptr<const Descriptor> opened = openFile(name, seen_before);
    struct stat status {};
    if (::fstat(opened->number(), &status) != 0 || !S_ISREG(status.st_mode))
      throw IoError(describe(name), "is not a regular file");
    const std::lock_guard lock(mutex_);
    File& file = files_.try_emplace(name, File{status.st_dev, status.st_ino, nullptr, {}}).first->second;
    if (file.device != status.st_dev || file.inode != status.st_ino) throw IoError(describe(name), kReplaced);
    if (file.open == nullptr) {
      recent_.push_front(&file);
      file.recent = recent_.begin();
      file.open = opened;
    }
    const std::shared_ptr<const Descriptor> answer = file.open;  // in use, so it is not closed here
    while (recent_.size() > most_open_ && closeOne()) {
    }
    return answer;
  }

  // Closes the least recently used open file that is not being read; false if there is none. The caller holds the lock,
  // so no read can begin meanwhile.
  bool closeOne() const {
    for (auto least = recent_.end(); least != recent_.begin();) {
      File& file = **--least;
      if (file.open.use_count() > 1) continue;
      file.open.reset();
      recent_.erase(least);
      return true;
    }
    return false;
  }

  std::shared_ptr<const Descriptor> openFile(const std::string& name, bool seen_before) const {
    const std::size_t slash = name.rfind('/');
    const std::string parent = slash == std::string::npos ? "" : name.substr(0, slash);
    std::shared_ptr<const Descriptor> folder = parent.empty() ? root_ : nullptr;
    if (folder == nullptr) {
      const std::lock_guard lock(mutex_);
      const auto found = folders_.find(parent);
      if (found != folders_.end()) folder = found->second;
    }
    if (folder == nullptr) {
      folder = openAt(root_->number(), parent, O_RDONLY | O_DIRECTORY);
      if (folder == nullptr) throw IoError(describe(name), "cannot be opened", errno);
      const std::lock_guard lock(mutex_);
      folder = folders_.try_emplace(parent, folder).first->second;
    }
    auto opened =
        openAt(folder->number(), slash == std::string::npos ? name : name.substr(slash + 1), O_RDONLY | O_NONBLOCK);
    if (opened == nullptr && seen_before && errno == ENOENT) throw IoError(describe(name), kReplaced);
    if (opened == nullptr) throw IoError(describe(name), "cannot be opened", errno);
    return opened;
  }

  // Returns nullptr and sets errno on failure. Closes another file if the process has no descriptor left.
  std::shared_ptr<const Descriptor> openAt(int folder, const std::string& name, int flags) const {
    for (;;) {
      Descriptor opened(::openat(folder, name.c_str(), flags | O_CLOEXEC));
      if (opened.isOpen()) return std::make_shared<Descriptor>(std::move(opened));
      const int error = errno;
      if (error == EMFILE || error == ENFILE) {
        const std::lock_guard lock(mutex_);
        if (closeOne()) continue;
      }
      errno = error;
      return nullptr;
    }
  }

  static constexpr const char* kReplaced = "was replaced or removed since the set was opened; open the set again";

  const std::string path_;
  const std::size_t most_open_;
  const std::shared_ptr<const Descriptor> root_;
  mutable std::mutex mutex_;                                                  // guards the members below
  mutable std::map<std::string, std::shared_ptr<const Descriptor>> folders_;  // below the root; they stay open
  mutable std::map<std::string, File> files_;
  mutable std::list<File*> recent_;  // open files, most recently used first
};

}  // namespace

bool isTileFileName(const std::string& name) {
  bool at_start = true;  // of a part between slashes
  for (char c : name) {
    const bool plain =
        (c >= 'A' && c <= 'Z') || (c >= 'a' && c <= 'z') || (c >= '0' && c <= '9') || c == '_' || c == '-';
    if (at_start ? !plain : !plain && c != '.' && c != '/') return false;
    at_start = c == '/';
  }
  return !at_start;
}

std::unique_ptr<TileSource> openFolder(const std::string& folder, std::size_t most_open) {
  return std::make_unique<Folder>(folder, most_open);
}

}  // namespace filiform
