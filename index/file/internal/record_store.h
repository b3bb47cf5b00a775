// Stores the bytes of reports: the first MiB in memory, the rest in an unnamed file. Thread rule: internally
// synchronised.
#pragma once

#include "index/file/internal/unnamed_file.h"

#include <cstdint>
#include <memory>
#include <mutex>
#include <span>
#include <vector>

namespace filiform::internal {

class RecordStore {
 public:
  // The store of the process; created when first needed, freed with its last user.
  static std::shared_ptr<RecordStore> shared();

  // Appends bytes and returns their position. Throws IoError.
  std::uint64_t append(std::span<const std::uint8_t> bytes);
  // Reads bytes at a position that append() returned. Throws IoError.
  void read(std::uint64_t at, std::span<std::uint8_t> bytes) const;

 private:
  static constexpr std::uint64_t kInMemory = std::uint64_t{1} << 20;
  mutable std::mutex mutex_;
  std::vector<std::uint8_t> memory_;
  UnnamedFile file_{"", "the list of dropped lines"};
  std::uint64_t end_ = 0;
};

}  // namespace filiform::internal
