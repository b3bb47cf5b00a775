#include "index/containers/internal/h5_container.h"

#include "index/errors.h"
#include "index/formats/internal/h5_morphology.h"
#include "index/text.h"

#include <algorithm>
#include <filesystem>
#include <iterator>
#include <system_error>
#include <utility>

namespace filiform::internal {

H5Container::H5Container(Hdf5Process& process, const std::string& path, const std::vector<std::string>* only) {
  std::error_code error;
  file_bytes_ = std::filesystem::file_size(path, error);
  if (error) throw IoError(inShort(path), "cannot read", error.value());
  std::vector<std::string> names = listH5Morphologies(process, path);
  any_ = !names.empty();
  single_ = names.size() == 1 && names[0].empty();
  if (only != nullptr && !single_) {
    std::vector<std::string> wanted;
    std::set_intersection(names.begin(), names.end(), only->begin(), only->end(), std::back_inserter(wanted));
    names = std::move(wanted);
  }
  for (std::string& name : names) {
    ArchiveEntry entry;
    entry.bytes = entry.packed_bytes = file_bytes_ / names.size();
    entry.kind = FileKind::h5;
    entry.morphology = entry.name = std::move(name);
    entries_.push_back(std::move(entry));
  }
}

}  // namespace filiform::internal
