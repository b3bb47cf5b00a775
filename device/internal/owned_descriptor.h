// A file descriptor that its owner closes. Thread rule: thread-compatible.
#pragma once

#include <unistd.h>
#include <utility>

namespace filiform::internal {

struct OwnedDescriptor {
  int number = -1;  // -1: none
  OwnedDescriptor() = default;
  explicit OwnedDescriptor(int of) : number(of) {}
  OwnedDescriptor(OwnedDescriptor&& other) noexcept : number(std::exchange(other.number, -1)) {}
  OwnedDescriptor& operator=(OwnedDescriptor&& other) noexcept {
    std::swap(number, other.number);
    return *this;
  }
  ~OwnedDescriptor() {
    if (number >= 0) ::close(number);
  }
};

}  // namespace filiform::internal
