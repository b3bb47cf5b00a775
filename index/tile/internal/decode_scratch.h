// DecodeScratch: vectors that a thread keeps between tiles, so that decoding a tile allocates only what the tile keeps.
// Thread rule: one object a thread.
#pragma once

#include <array>
#include <cstdint>
#include <utility>
#include <vector>

namespace filiform::internal {

class DecodeScratch {
 public:
  std::array<std::vector<std::uint64_t>, 3> stated;            // positions that are stored directly, by axis
  std::vector<std::uint16_t> sums;                             // of steps
  std::vector<std::uint64_t> group_of;                         // by run
  std::vector<std::uint32_t> next_run;                         // by group
  std::vector<std::pair<std::uint32_t, std::uint32_t>> extra;  // (node, segment)
  std::vector<std::uint32_t> listed, counts;

  // The calling thread's.
  static DecodeScratch& here() {
    static thread_local DecodeScratch scratch;
    return scratch;
  }
  // Trims the thread's vectors at the end of its scope.
  struct Trimmed {
    Trimmed() = default;
    Trimmed(const Trimmed&) = delete;
    Trimmed& operator=(const Trimmed&) = delete;
    ~Trimmed() { here().trim(); }
  };

 private:
  // Frees the vectors of a large tile.
  void trim() {
    constexpr std::size_t kMostKept = std::size_t{1} << 16;  // elements
    if (sums.capacity() > 4 * kMostKept || group_of.capacity() > kMostKept || counts.capacity() > kMostKept ||
        extra.capacity() > kMostKept || stated[0].capacity() > kMostKept)
      *this = {};
  }
};

}  // namespace filiform::internal
