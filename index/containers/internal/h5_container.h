// An H5 file of morphologies: the entries are its morphologies, named as in the file. Thread rule: as Container.
#pragma once

#include "index/containers/internal/container.h"
#include "index/hdf5/internal/hdf5_process.h"

#include <memory>
#include <string>
#include <vector>

namespace filiform::internal {

// Its entries are read by readH5Morphology() (h5_morphology.h), in the process of the reading thread; reader() returns
// null.
class H5Container final : public Container {
 public:
  // Lists the file with `process`; without morphologies it has no entries. `only`: the names to keep, ascending; null:
  // all. Throws IoError.
  H5Container(Hdf5Process& process, const std::string& path, const std::vector<std::string>* only);

  static constexpr const char* kNoMorphology = "holds no morphology; give a file of nodes with --morphologies";

  // The file holds a morphology, wanted or not.
  bool holdsAny() const { return any_; }
  // The file is one morphology without a name.
  bool isSingle() const { return single_; }
  std::unique_ptr<Reader> reader() const override { return nullptr; }

 private:
  bool any_ = false, single_ = false;
};

}  // namespace filiform::internal
