#include "index/input/internal/file_listing.h"

#include "index/errors.h"
#include "index/input/internal/folder_walk.h"
#include "index/text.h"

#include <filesystem>
#include <fstream>
#include <system_error>
#include <utility>

namespace filiform::internal {
namespace {

namespace fs = std::filesystem;

bool holdsCells(std::string_view file_name) {
  return endsWithNoCase(file_name, ".swc") || endsWithNoCase(file_name, ".zip");
}

bool isSkeletonId(std::string_view file_name) {
  return file_name.find_first_not_of("0123456789") == std::string_view::npos;
}

std::vector<ListedFile> listFolder(const std::string& folder) {
  std::vector<ListedFile> files;
  for (WalkedFile& f : walkFolder(folder, holdsCells))
    files.push_back({std::move(f.path), std::move(f.shown), std::move(f.unreadable)});
  return files;
}

// The files of a folder of Neuroglancer skeletons, by id as text; empty for another folder.
std::vector<ListedFile> listSkeletons(const std::string& folder) {
  const std::string info_path = (fs::path(folder) / "info").native();
  std::error_code error;
  if (!fs::is_regular_file(info_path, error) || fs::file_size(info_path, error) > SkeletonInfo::kMaxBytes || error)
    return {};
  std::ifstream in(info_path, std::ios::binary);
  const std::string text((std::istreambuf_iterator<char>(in)), std::istreambuf_iterator<char>());
  if (!SkeletonInfo::isSkeletonInfo(text)) return {};
  const auto info = std::make_shared<const SkeletonInfo>(SkeletonInfo::parse(text, info_path));
  std::vector<ListedFile> files;
  for (WalkedFile& f : walkFolder(folder, isSkeletonId, WalkDepth::folder_only))
    files.push_back(
        {std::move(f.path), std::move(f.shown), std::move(f.unreadable), GraphFormat::kNeuroglancerSkeleton, info});
  if (files.empty()) throw InputError(escaped(folder) + ": its info is that of skeletons, but it holds none");
  return files;
}

}  // namespace

std::vector<ListedFile> listFiles(const std::string& folder) {
  std::vector<ListedFile> files = listSkeletons(folder);
  return files.empty() ? listFolder(folder) : files;
}

}  // namespace filiform::internal
