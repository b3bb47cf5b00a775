// A table of skeletons that CATMAID exports as CSV (catmaid_table.h). Its entries are the skeletons, named by their
// ids, in the order in which they begin; their lines may be mixed. The file is read once to find them. Memory: 24 bytes
// for each run of lines of one skeleton. Thread rule: as Container.
#pragma once

#include "index/containers/internal/container.h"

#include <functional>
#include <memory>
#include <string>
#include <vector>

namespace filiform {

class CatmaidFile final : public Container {
 public:
  // Refusals: E_FORMAT for a table without the columns of a skeleton; E_ZIP_NO_SWC without a line. `progress` receives
  // the size of each block read. Throws IoError, and what `progress` throws.
  explicit CatmaidFile(std::string path, const std::function<void(std::uint64_t bytes)>& progress = {});

  std::unique_ptr<Reader> reader() const override;

 private:
  class Listing;
  class TableReader;
  struct Run {
    std::uint64_t at, bytes, line;
  };
  std::string path_, header_;
  std::vector<std::vector<Run>> runs_;  // by ArchiveEntry::index
};

}  // namespace filiform
