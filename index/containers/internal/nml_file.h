// An NML file of KNOSSOS or webKnossos (nml.h). Its entries are the trees, named as in the file. All of the file is in
// memory while it is listed. Thread rule: as Container.
#pragma once

#include "index/containers/internal/container.h"
#include "index/formats/internal/nml.h"

#include <functional>
#include <memory>
#include <string>

namespace filiform {

class NmlFile final : public Container {
 public:
  // Refusals: E_FORMAT, with what is wrong or the name of the other XML format; E_ZIP_NO_SWC without a tree. `progress`
  // receives the size of each block read. Throws IoError, and what `progress` throws.
  explicit NmlFile(std::string path, const std::function<void(std::uint64_t bytes)>& progress = {});

  std::unique_ptr<Reader> reader() const override;

 private:
  class TreeReader;
  std::string path_;
  internal::NmlOutline outline_;  // of the entries, by ArchiveEntry::index
};

}  // namespace filiform
