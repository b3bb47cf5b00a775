// Lists the files of a folder that may hold cells. Thread rule: pure functions.
#pragma once

#include "index/input/internal/graph_file.h"

#include <memory>
#include <optional>
#include <string>
#include <vector>

namespace filiform::internal {

struct ListedFile {
  std::string path;
  std::string shown;            // path below the argument
  std::string unreadable = {};  // why it cannot be read
  // For a graph:
  std::optional<GraphFormat> format = {};
  std::shared_ptr<const SkeletonInfo> skeleton = {};
};

// The files of a folder of Neuroglancer skeletons by id as text; of another folder, all *.swc and *.zip by path
// (index/input/input.h). Throws InputError for a folder of skeletons without any, or with an `info` that cannot be
// used; IoError if the process has no file descriptor or memory left.
std::vector<ListedFile> listFiles(const std::string& folder);

}  // namespace filiform::internal
