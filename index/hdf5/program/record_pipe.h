// RecordPipe: the standard input and output of filiform-hdf5, as index/hdf5/internal/hdf5_protocol.h specifies them.
#pragma once

#include "index/hdf5/internal/hdf5_protocol.h"

#include <chrono>
#include <cstddef>
#include <cstdint>
#include <stdexcept>
#include <string>
#include <vector>

namespace filiform::hdf5 {

// Why a request has no answer; for the user, without the file's name.
class Failure : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

// Thread rule: thread-compatible. Ends the process if the other side of the pipe is gone.
class RecordPipe {
 public:
  bool readRequest(std::vector<std::string>& request);  // false: no more requests
  bool readBlock(std::string& block);                   // of values to write; false: the last one
  void send(RecordKind kind, const void* payload, std::size_t bytes);
  void send(RecordKind kind, const std::string& payload) { send(kind, payload.data(), payload.size()); }
  void end() { send(RecordKind::end, nullptr, 0); }
  // Sends an empty record of names if nothing was sent for a second, so that filiform waits on.
  void alive();
  void fail(const std::string& why) { send(RecordKind::failure, why.substr(0, 1000)); }
  // Sends many bytes as records of at most 1 MiB, each a whole number of `unit` bytes.
  void sendAll(RecordKind kind, const void* bytes, std::size_t count, std::size_t unit);

  static void putU32(std::string& out, std::uint32_t value);
  static void putU64(std::string& out, std::uint64_t value);
  static void putText(std::string& out, const std::string& text);  // bytes u32, text

 private:
  std::chrono::steady_clock::time_point last_ = std::chrono::steady_clock::now();
};

}  // namespace filiform::hdf5
