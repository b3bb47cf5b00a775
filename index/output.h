// Output: one result of a command, written to a file, a device, a pipe or standard output. All result files that a
// command names are written through this class.
//
//   Output csv("travel.csv");
//   csv.stream() << "tick,time_s\n";
//   csv.finish();  // without this call an older travel.csv stays unchanged
//
// The path decides what happens:
//   a regular file, or nothing   writes a new file beside it; finish() renames it over the path and keeps permissions
//   a symbolic link              the link stays; its target is replaced as above, in the target's folder
//   a device, a pipe             written directly; never removed, renamed or truncated
//   "-", /dev/stdout, /dev/fd/N  written directly to that open descriptor, at its current position
//
// Thread rule: thread-compatible.
#pragma once

#include "index/errors.h"

#include <atomic>
#include <functional>
#include <iosfwd>
#include <memory>
#include <string>
#include <string_view>

namespace filiform {

struct OutputOptions {
  // For a library or program that opens the file itself: it fills the file partialPath() instead of stream(). That file
  // has the same ending as the path. For a device or a pipe it lies in the folder for temporary files.
  bool by_name = false;
  bool sync = true;  // flush to disk before the rename, so that a power cut leaves either the old or the new file
  const std::atomic<bool>* cancel = nullptr;  // when true: stop waiting for a pipe's reader, throw Interrupted
  // Makes the incomplete file of this name usable, for finishAside() after a failed write, as on a full disk.
  std::function<void(const std::string& partial)> mend{};
};

// For OutputOptions::mend: cuts a text file after its last whole line. Throws IoError.
void cutToWholeLines(const std::string& path);

class Output {
 public:
  // Opens the destination. For a pipe, waits for a reader. Throws UsageError for an empty path. Throws IoError if the
  // path is a folder or not writable, or if its folder is missing or not writable.
  explicit Output(const std::string& path, const OutputOptions& options = {});
  // Without finish(): leaves a regular file unchanged and removes the new file beside it.
  ~Output();
  Output(const Output&) = delete;
  Output& operator=(const Output&) = delete;

  // The stream to write to; its operators throw as write() does.
  std::ostream& stream() noexcept;
  // Throws IoError if the disk is full or the device fails, ClosedPipe if the reader of a pipe has closed it.
  void write(std::string_view bytes);
  const std::string& partialPath() const noexcept;  // only with by_name

  // Publishes a regular file. For a device, pipe or descriptor: writes the remaining bytes. Nothing may be written
  // afterwards; a second call does nothing. Throws as write() does.
  void finish();
  // Publishes an incomplete result: at the path if nothing exists there, otherwise beside it as NAME.unfinished.ENDING
  // or, if this exists too, NAME.unfinished-2.ENDING. Returns the name used. For a device, pipe or descriptor: calls
  // finish() and returns the path. After a failed write, of this or of finish(), mends the file first; without
  // OutputOptions::mend throws IoError. Throws as finish() and `mend` do.
  std::string finishAside();

  const std::string& path() const noexcept;  // as given
  bool isFile() const noexcept;              // a regular file, or a path where nothing exists yet
  bool isStandardOutput() const noexcept;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

// The destination that a result path leads to.
struct OutputPlace {
  enum class Kind { kFile, kThrough, kDescriptor };
  Kind kind = Kind::kFile;
  std::string target;   // the path with all links resolved
  int descriptor = -1;  // kDescriptor: 1 is standard output
  bool exists = false;
};
// Resolves `path` without opening it. Throws UsageError for an empty path, IoError if the path cannot be resolved or is
// a folder.
OutputPlace outputPlace(const std::string& path);

// Throws InputError if the name ends as an input does (.swc, .zip and others): for a folder that a command makes.
void refuseInputName(const std::string& folder);

}  // namespace filiform
