// Descriptor: an open file, closed by its destructor.
#pragma once

#include <cerrno>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <unistd.h>
#include <utility>

namespace filiform::internal {

// Calls call(done) until `bytes` are done or a call does none. `call` returns the number of bytes that it has done, or
// -1 with errno; if a signal interrupts it, it is called again. Returns the number of bytes done; nullopt, with errno,
// after an error. With fewer bytes done than `bytes`, errno is `none`.
template <typename Call>
std::optional<std::size_t> repeatCall(std::size_t bytes, int none, const Call& call) {
  std::size_t done = 0;
  while (done < bytes) {
    const ssize_t n = call(done);
    if (n < 0 && errno == EINTR) continue;
    if (n < 0) return std::nullopt;
    if (n == 0) {
      errno = none;
      break;
    }
    done += static_cast<std::size_t>(n);
  }
  return done;
}

// Thread rule: thread-compatible; any number of threads may call readAt() and writeAt().
class Descriptor {
 public:
  Descriptor() = default;
  explicit Descriptor(int number) : number_(number) {}  // from open(); below 0: not open
  Descriptor(Descriptor&& other) noexcept : number_(std::exchange(other.number_, -1)) {}
  Descriptor& operator=(Descriptor&& other) noexcept {
    std::swap(number_, other.number_);
    return *this;
  }
  ~Descriptor() {
    if (isOpen()) ::close(number_);
  }

  bool isOpen() const { return number_ >= 0; }
  int number() const { return number_; }
  // Return the number of bytes read: fewer than asked for if the file ends, with EIO in errno. nullopt, with errno,
  // after an error.
  std::optional<std::size_t> read(void* to, std::size_t bytes) const {
    return repeatCall(bytes, EIO,
                      [&](std::size_t done) { return ::read(number_, static_cast<char*>(to) + done, bytes - done); });
  }
  std::optional<std::size_t> readAt(std::uint64_t offset, void* to, std::size_t bytes) const {
    return repeatCall(bytes, EIO, [&](std::size_t done) {
      return ::pread(number_, static_cast<char*>(to) + done, bytes - done, static_cast<off_t>(offset + done));
    });
  }
  // Return false, with errno, if not all bytes were written.
  bool write(const void* from, std::size_t bytes) const {
    return bytes == repeatCall(bytes, ENOSPC, [&](std::size_t done) {
             return ::write(number_, static_cast<const char*>(from) + done, bytes - done);
           });
  }
  bool writeAt(std::uint64_t offset, const void* from, std::size_t bytes) const {
    return bytes == repeatCall(bytes, ENOSPC, [&](std::size_t done) {
             return ::pwrite(number_, static_cast<const char*>(from) + done, bytes - done,
                             static_cast<off_t>(offset + done));
           });
  }
  // Returns false, with errno, if writing failed meanwhile.
  bool close() { return !isOpen() || ::close(std::exchange(number_, -1)) == 0 || errno == EINTR; }

 private:
  int number_ = -1;
};

}  // namespace filiform::internal
