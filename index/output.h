// One result of a command: a regular file, a device, a pipe, or standard output. Every file that a command names for
// its results is written through this class.
//
//   Output csv("travel.csv");
//   csv.stream() << "tick,time_s\n";
//   csv.finish();  // without it an older travel.csv stays as it was
//
// What the path is decides what happens:
//   a regular file, or nothing   a new file beside it, renamed over it by finish(); its permissions are kept
//   a symbolic link              its target is treated so, beside itself; the link stays
//   a device, a pipe             written through at once; never removed, renamed or cut
//   "-", /dev/stdout, /dev/fd/N  written through to that open descriptor, at its place
// Thread rule: thread-compatible.
#pragma once

#include <atomic>
#include <iosfwd>
#include <memory>
#include <string>
#include <string_view>

namespace filiform {

struct OutputOptions {
  // A writer that insists on a name of its own (a library, another program) fills the file partialPath() instead of
  // stream(). It has the ending of the path. For a device or a pipe it lies in the folder for temporary files.
  bool by_name = false;
  bool sync = true;  // on the disk before it gets its name, so that a power cut leaves the old file or the new one
  const std::atomic<bool>* cancel = nullptr;  // becomes true: stop waiting for a pipe's reader, throw Interrupted
};

class Output {
 public:
  // Opens the destination. Waits for a reader where the path is a pipe. Throws UsageError for an empty path, IoError
  // where the path is a folder, may not be written, or its folder is missing or may not be written.
  explicit Output(const std::string& path, const OutputOptions& options = {});
  // Without finish(): a regular file is untouched, and the file beside it is removed.
  ~Output();
  Output(const Output&) = delete;
  Output& operator=(const Output&) = delete;

  // Throws IoError where the disk is full or the device fails, ClosedPipe where the reader of a pipe has gone; the
  // stream's operators do so too.
  std::ostream& stream() noexcept;
  void write(std::string_view bytes);
  const std::string& partialPath() const noexcept;  // by_name only

  // Publishes a regular file; for the rest, writes what is left. Nothing may be written afterwards. Throws as write()
  // does. Does nothing the second time.
  void finish();
  // Publishes what was written although the work did not come to its end: under the path where nothing is there,
  // otherwise under a new name beside it. Returns the name. For what is written through: finish(), and the path.
  // Throws as finish() does, and IoError after a write that failed.
  std::string finishAside();

  const std::string& path() const noexcept;  // as given
  bool isFile() const noexcept;              // a regular file, or none as yet
  bool isStandardOutput() const noexcept;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

// What a path given for a result leads to. Opens nothing.
struct OutputPlace {
  enum class Kind { kFile, kThrough, kDescriptor };
  Kind kind = Kind::kFile;
  std::string target;   // all links followed
  int descriptor = -1;  // kDescriptor: 1 is standard output
  bool exists = false;
};
// Throws UsageError for an empty path, IoError where the path cannot be followed or is a folder.
OutputPlace outputPlace(const std::string& path);

}  // namespace filiform
