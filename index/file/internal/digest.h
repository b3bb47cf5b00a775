// Checksums and digests: XXH3, 64 bits. Only digest.cpp knows the library.
#pragma once

#include <cstdint>
#include <memory>
#include <span>
#include <string_view>

namespace filiform::internal {

// Pure functions, any thread. O(bytes).
std::uint64_t checksum(std::span<const std::uint8_t> bytes, std::uint64_t seed = 0);
std::uint64_t checksum(std::string_view text, std::uint64_t seed = 0);

// The checksum of bytes that arrive in pieces, without a seed. Thread rule: thread-compatible. Throws std::bad_alloc
// when it is made.
class RunningDigest {
 public:
  RunningDigest();
  RunningDigest(RunningDigest&&) noexcept;
  RunningDigest& operator=(RunningDigest&&) noexcept;
  ~RunningDigest();
  void add(std::span<const std::uint8_t> bytes);
  void add(std::string_view text);
  std::uint64_t value() const;  // of everything added since the last reset()
  void reset();

 private:
  struct State;
  std::unique_ptr<State> state_;
};

}  // namespace filiform::internal
