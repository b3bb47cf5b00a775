// Sha256: the SHA-256 of bytes that arrive in pieces. Only sha256.cpp knows the library.
#pragma once

#include <cstdint>
#include <memory>
#include <span>
#include <string>

namespace filiform::internal {

// Thread rule: thread-compatible. Throws std::bad_alloc when it is made.
class Sha256 {
 public:
  Sha256();
  ~Sha256();
  void add(std::span<const std::uint8_t> bytes);  // O(bytes)
  std::string value();                            // 64 digits, lower case; call it once, last

 private:
  struct State;
  std::unique_ptr<State> state_;
};

}  // namespace filiform::internal
