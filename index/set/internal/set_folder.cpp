#include "index/set/internal/set_folder.h"

#include "index/errors.h"
#include "index/file/internal/output_file.h"
#include "index/file/internal/set_files.h"
#include "index/output.h"
#include "index/set/internal/manifest.h"
#include "index/set/tile_set.h"
#include "index/text.h"

#include <algorithm>
#include <cerrno>
#include <fcntl.h>
#include <filesystem>
#include <new>
#include <string_view>
#include <sys/file.h>
#include <unistd.h>
#include <vector>

namespace filiform::internal {
namespace {

namespace fs = std::filesystem;

constexpr std::string_view kTemporary = ".tmp-";

std::string temporaryName(const std::string& name) {
  return name + std::string(kTemporary) + std::to_string(::getpid());
}

// True for the names that this class and asideOf() give: only these are removed from a set's folder.
bool isTemporaryName(const std::string& name) {
  const std::size_t at = name.find(kTemporary);
  if (at == std::string::npos) return false;
  const std::string stem = name.substr(0, at), process = name.substr(at + kTemporary.size());
  return (stem == "new" || stem == "add" || stem == kCurrentFile || isRevisionName(stem)) && !process.empty() &&
         process.find_first_not_of("0123456789") == std::string::npos;
}

// True if the folder's CURRENT names a revision; other programs also have files of this name.
bool isSet(const fs::path& folder) {
  const Descriptor file(::open((folder / kCurrentFile).c_str(), O_RDONLY | O_NONBLOCK | O_CLOEXEC));
  std::string name(19, '\0');
  return file.isOpen() && file.read(name.data(), name.size()) == name.size() && name.back() == '\n' &&
         isRevisionName(name.substr(0, 18));
}

void refuseInsideSet(const std::string& path) {
  std::error_code error;
  const fs::path whole = fs::weakly_canonical(fs::absolute(path, error), error);
  for (fs::path folder = whole.parent_path(); folder.has_relative_path(); folder = folder.parent_path())
    if (isSet(folder) && whole != fs::path(asideOf(folder.string())))
      throw InputError(escaped(path) + ": lies inside the tile set " + escaped(folder.string()) +
                       "; choose a place outside");
}

bool holdsValidSet(const std::string& path) {
  try {
    const auto set = TileSet::open(path);
    for (const SetFile& file : set->files()) set->checkFile(file);
    return true;
  } catch (const Error&) {
    return false;
  }
}

}  // namespace

std::string asideOf(const std::string& set) { return set + "/" + temporaryName("add"); }

SetFolder::SetFolder(const std::string& path, Purpose purpose) : path_(path) {
  std::error_code error;
  const fs::file_status status = fs::status(path, error);
  bool created = false;
  if (!fs::exists(status)) {
    if (purpose == Purpose::grow) throw IoError(path, "is missing; make a set with filiform ingest");
    refuseInputName(path);
    refuseInsideSet(path);
    created = fs::create_directory(path, error);
    if (error) throw IoError(path, "cannot be created", error.value());
  } else if (!fs::is_directory(status)) {
    throw InputError(path + ": exists and is not a tile set; choose another name");
  }
  try {
    lock();
    created_ = created;
    if (!created_) inspect(purpose);
    // The revision's name is known only after everything is written.
    building_ = path + "/" + temporaryName("new");
    fs::remove_all(building_);
    fs::create_directory(building_);
  } catch (const fs::filesystem_error& e) {
    undo();
    if (created) fs::remove(path, error);  // fails if another process already uses it
    throw IoError(path, "cannot be written", e.code().value());
  } catch (...) {
    undo();
    if (created) fs::remove(path, error);
    throw;
  }
}

bool SetFolder::publish(const std::string& revision, const std::vector<std::string>& in_use) {
  try {
    const std::string target = path_ + "/" + revision;
    if (revision == previous_ && holdsValidSet(path_)) {
      removeOthers(revision, in_use);
      return false;
    }
    if (fs::exists(target)) {  // damaged, or left by a crash before CURRENT was written
      const std::string aside = path_ + "/" + temporaryName(revision);
      fs::remove_all(aside);
      fs::rename(target, aside);
      aside_ = aside;
    }
    target_ = target;
    fs::rename(building_, target);
    syncFolder(path_);
    writeCurrent(revision);
    for (std::string* undone : {&building_, &target_, &aside_}) undone->clear();
  } catch (const fs::filesystem_error& e) {
    throw IoError(path_, "cannot be published", e.code().value());
  }
  syncFolder(path_);
  const fs::path parent = fs::path(path_).parent_path();
  syncFolder(parent.empty() ? "." : parent.string());
  removeOthers(revision, in_use);
  return true;
}

void SetFolder::publishPresent(const std::string& revision, const std::vector<std::string>& in_use) {
  try {
    syncFolder(path_);
    writeCurrent(revision);
  } catch (const fs::filesystem_error& e) {
    throw IoError(path_, "cannot be published", e.code().value());
  }
  syncFolder(path_);
  removeOthers(revision, in_use);
}

void SetFolder::writeCurrent(const std::string& revision) {
  const std::string next = path_ + "/" + temporaryName(kCurrentFile);
  fs::remove(next);
  next_ = next;
  OutputFile file(next);
  const std::string text = revision + "\n";
  file.write(text);
  file.close();
  fs::rename(next, path_ + "/" + kCurrentFile);
  created_ = false;
  next_.clear();
}

void SetFolder::lock() {
  folder_ = Descriptor(::open(path_.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC));
  if (!folder_.isOpen()) throw IoError(path_, "cannot be opened", errno);
  if (::flock(folder_.number(), LOCK_EX | LOCK_NB) != 0) {
    if (errno == EWOULDBLOCK) throw InputError(path_ + ": another ingest is writing this set; wait for it");
    throw IoError(path_, "cannot be locked", errno);
  }
}

void SetFolder::inspect(Purpose purpose) {
  bool has_current = false;
  for (const fs::directory_entry& entry : fs::directory_iterator(path_)) {
    const std::string name = entry.path().filename().string();
    if (name == kCurrentFile) {
      has_current = true;
    } else if (!isRevisionName(name) && !isTemporaryName(name)) {
      throw InputError(path_ + ": holds a file that filiform did not make (" + escaped(name, 80) +
                       "); move it, or choose another name");
    }
  }
  if (purpose == Purpose::grow) {
    if (!has_current) throw InputError(path_ + ": is not a tile set; make one with filiform ingest");
    previous_ = TileSet::open(path_)->revision();
    return;
  }
  if (!has_current) return;
  if (purpose == Purpose::create) throw InputError(path_ + ": is already a tile set; --force replaces it");
  try {
    const auto set = TileSet::open(path_);
    previous_ = set->revision();
  } catch (const Error&) {
    // Damaged: will be replaced.
  }
}

// Readers keep their open files. The next ingest removes what cannot be removed now.
void SetFolder::removeOthers(const std::string& revision, const std::vector<std::string>& in_use) noexcept {
  try {
    std::error_code ignored;
    std::vector<fs::path> others;
    for (fs::directory_iterator at(path_, ignored), end; at != end; at.increment(ignored)) {
      const std::string name = at->path().filename().string();
      const bool used = name == revision || std::find(in_use.begin(), in_use.end(), name) != in_use.end();
      if (!used && (isRevisionName(name) || isTemporaryName(name))) others.push_back(at->path());
    }
    for (const fs::path& other : others) fs::remove_all(other, ignored);
  } catch (const std::bad_alloc&) {
  }
}

void SetFolder::undo() noexcept {
  try {
    std::error_code ignored;
    removeMade();
    if (!aside_.empty()) {
      fs::remove_all(target_, ignored);
      fs::rename(aside_, target_, ignored);
    }
    folder_ = {};
    removeMade();                              // listing needs one more file descriptor
    if (created_) fs::remove(path_, ignored);  // fails if it holds files of others, or another process already uses it
  } catch (const std::bad_alloc&) {
    // Without memory nothing can be removed; the next ingest removes it.
  }
  for (std::string* undone : {&building_, &target_, &aside_, &next_}) undone->clear();
  created_ = false;
  folder_ = {};
}

void SetFolder::removeMade() const {
  std::error_code ignored;
  for (const std::string* made : {&building_, &next_})
    if (!made->empty()) fs::remove_all(*made, ignored);
  if (!target_.empty() && aside_.empty()) fs::remove_all(target_, ignored);
}

}  // namespace filiform::internal
