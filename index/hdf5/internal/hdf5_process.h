// Hdf5Process: the program filiform-hdf5, which reads HDF5 files in a process of its own
// (index/hdf5/internal/hdf5_protocol.h).
//
// It is searched in this order: the path in the variable FILIFORM_HDF5; beside the running program, and in
// ../libexec/filiform from there; the same from the shared library that holds this code, and from the folders of PATH;
// the path that nameHdf5Program() named; where the build would install it.
#pragma once

#include "index/hdf5/internal/hdf5_protocol.h"
#include "index/internal/descriptor.h"

#include <cstdint>
#include <functional>
#include <span>
#include <string>
#include <string_view>
#include <sys/types.h>
#include <vector>

namespace filiform::internal {

using Hdf5Bytes = std::span<const std::uint8_t>;

// A record whose checksum is right. `bytes` is valid during the call.
using UseRecord = std::function<void(hdf5::RecordKind kind, Hdf5Bytes bytes)>;

// The text of a `failure`.
struct Hdf5Failure {
  std::string what;
};

// Reads the records of one answer from `read`, which fills its argument, and passes them to `use` until `end`. Throws
// Damage for bytes that are no such records, and Hdf5Failure. Memory: one record.
void readAnswer(const std::function<void(std::span<std::uint8_t> bytes)>& read, const UseRecord& use);
// Splits a payload of names and passes each to `use`. Throws Damage.
void splitNames(Hdf5Bytes payload, const std::function<void(std::string_view text)>& use);

// Thread rule: thread-compatible; one a thread.
class Hdf5Process {
 public:
  Hdf5Process() = default;
  Hdf5Process(const Hdf5Process&) = delete;
  Hdf5Process& operator=(const Hdf5Process&) = delete;
  ~Hdf5Process() { stop(); }

  // Sends a request, with `file` as its first argument, and passes the records of the answer to `use`. Starts the
  // program if it does not run. Throws IoError naming `file` if the file cannot be read: a failure of the program, its
  // death, or no byte for kSeconds (the variable FILIFORM_HDF5_SECONDS changes it). Time does not count while this
  // process is stopped, or while the program waits for a processor. The next call then starts the program again.
  // Throws IoError naming the program if it cannot be started, a shortage unless it is absent. What `use` throws ends
  // the process too.
  void ask(const std::string& op, const std::string& file, const std::vector<std::string>& arguments,
           const UseRecord& use) {
    ask(op, file, arguments, use, {});
  }
  // The same for `write`, whose request has no file and is followed by blocks of `values`.
  void ask(const std::string& op, const std::string& file, const std::vector<std::string>& arguments,
           const UseRecord& use, Hdf5Bytes values);
  void stop() noexcept;   // kills the program
  void close() noexcept;  // lets it end by itself; kills it after kSeconds

  static constexpr int kSeconds = 20;

 private:
  void start();
  bool waitFor(const Descriptor& file, short events) const;
  void send(Hdf5Bytes bytes);
  void readSome(std::span<std::uint8_t> bytes);
  std::string deathOf();

  pid_t child_ = -1;
  Descriptor to_, from_;
  std::vector<std::uint8_t> buffer_;
  std::size_t at_ = 0;
};

}  // namespace filiform::internal
