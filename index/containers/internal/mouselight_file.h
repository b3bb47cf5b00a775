// A MouseLight JSON file: a list `neurons`, also in an object `contents` as the API has it, a bare list of neurons, or
// one neuron. Its entries are the neurons, named by `idString`. The file is read once to find them, in constant memory.
// Thread rule: as Container.
#pragma once

#include "index/containers/internal/container.h"

#include <functional>
#include <memory>
#include <string>

namespace filiform {

class MouseLightFile final : public Container {
 public:
  // Refusals: E_FORMAT, with the line and what is wrong; E_ZIP_NO_SWC without a neuron. `progress` receives the size of
  // each block read. Throws IoError, and what `progress` throws.
  explicit MouseLightFile(std::string path, const std::function<void(std::uint64_t bytes)>& progress = {});

  std::unique_ptr<Reader> reader() const override;

 private:
  std::string path_;
};

}  // namespace filiform
