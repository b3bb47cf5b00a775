#include "tools/program/output_check.h"

#include "index/errors.h"
#include "index/output.h"
#include "index/text.h"

#include <cerrno>
#include <filesystem>
#include <optional>
#include <set>
#include <sys/stat.h>
#include <sys/sysmacros.h>
#include <unistd.h>
#include <utility>

namespace filiform::tools {

namespace {

namespace fs = std::filesystem;

using FileId = std::pair<dev_t, ino_t>;

std::optional<struct stat> statOf(const std::string& path) {
  struct stat what {};
  if (path.empty() || ::stat(path.c_str(), &what) != 0) return std::nullopt;
  return what;
}

FileId idOf(const struct stat& what) { return {what.st_dev, what.st_ino}; }

bool isNullDevice(const struct stat& what) { return S_ISCHR(what.st_mode) && what.st_rdev == makedev(1, 3); }

// Adds the files below a folder. Follows links; enters each folder once.
void addFiles(const std::string& path, std::set<FileId>& files, std::set<FileId>& folders) {
  const auto what = statOf(path);
  if (!what) return;
  if (!S_ISDIR(what->st_mode)) {
    files.insert(idOf(*what));
    return;
  }
  if (!folders.insert(idOf(*what)).second) return;
  std::error_code error;  // ignored: the command cannot read a folder that cannot be listed
  for (fs::directory_iterator at(path, error), end; !error && at != end; at.increment(error))
    addFiles(at->path().string(), files, folders);
}

std::set<FileId> filesOf(const std::vector<NamedPath>& inputs) {
  std::set<FileId> files, folders;
  for (const NamedPath& input : inputs) addFiles(input.path, files, folders);
  return files;
}

std::string said(const NamedPath& named) { return named.option + " " + inShort(named.path); }

std::string parentOf(const std::string& path) {
  const std::string parent = fs::path(path).parent_path().string();
  return parent.empty() ? "." : parent;
}

// Identifies the place of an output. Two outputs with the same text would overwrite each other. Empty: the place may
// take several outputs.
std::string placeOf(const OutputPlace& place) {
  if (place.kind == OutputPlace::Kind::kDescriptor) return "descriptor " + std::to_string(place.descriptor);
  const auto what = statOf(place.target);
  if (what && isNullDevice(*what)) return {};
  if (what) return std::to_string(what->st_dev) + " " + std::to_string(what->st_ino);
  const auto folder = statOf(parentOf(place.target));
  if (!folder) return place.target;
  return std::to_string(folder->st_dev) + " " + std::to_string(folder->st_ino) + " " +
         fs::path(place.target).filename().string();
}

void checkWritable(const NamedPath& output, const OutputPlace& place) {
  if (place.kind == OutputPlace::Kind::kDescriptor) return;
  if (place.exists && ::access(place.target.c_str(), W_OK) != 0)
    throw IoError(inShort(output.path), "cannot write", errno);
  if (place.kind != OutputPlace::Kind::kFile) return;
  const std::string folder = parentOf(place.target);
  if (::access(folder.c_str(), W_OK | X_OK) != 0)
    throw IoError(inShort(output.path), "cannot write into its folder", errno);
}

}  // namespace

void checkOutputs(const std::vector<NamedPath>& inputs, const std::vector<NamedPath>& outputs) {
  std::optional<std::set<FileId>> read;
  std::vector<std::pair<std::string, const NamedPath*>> written;
  for (const NamedPath& output : outputs) {
    if (output.path.empty()) continue;
    const OutputPlace place = outputPlace(output.path);
    if (const auto what = statOf(place.target); what && S_ISREG(what->st_mode)) {
      if (!read) read = filesOf(inputs);
      if (read->contains(idOf(*what)))
        throw UsageError(said(output) + ": is an input of this command; name another file");
    }
    const std::string where = placeOf(place);
    for (const auto& [other_place, other] : written)
      if (!where.empty() && other_place == where)
        throw UsageError(said(*other) + " and " + said(output) + " are the same place; name two files");
    written.emplace_back(where, &output);
    checkWritable(output, place);
  }
}

void checkOutputFolder(const std::vector<NamedPath>& inputs, const NamedPath& folder) {
  if (!statOf(folder.path)) return;
  const std::set<FileId> read = filesOf(inputs);
  std::error_code error;
  for (fs::directory_iterator at(folder.path, error), end; !error && at != end; at.increment(error)) {
    const auto what = statOf(at->path().string());
    if (what && S_ISREG(what->st_mode) && read.contains(idOf(*what)))
      throw UsageError(said(folder) + ": holds an input of this command, " + inShort(at->path().filename().string()) +
                       "; name another folder");
  }
}

bool isStandardOutput(const std::string& path) {
  if (path.empty()) return false;
  try {
    const OutputPlace place = outputPlace(path);
    return place.kind == OutputPlace::Kind::kDescriptor && place.descriptor == STDOUT_FILENO;
  } catch (const Error&) {
    return false;
  }
}

bool isFileOutput(const std::string& path) {
  if (path.empty()) return false;
  try {
    return outputPlace(path).kind == OutputPlace::Kind::kFile;
  } catch (const Error&) {
    return false;
  }
}

}  // namespace filiform::tools
