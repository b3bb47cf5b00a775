// A folder that a command fills with files. Thread rule: thread-compatible.
#pragma once

#include <string>
#include <string_view>
#include <vector>

namespace filiform::tools {

// Makes the folder, or takes an empty one. Without finish(), the destructor removes everything that was made.
class OutputFolder {
 public:
  // Throws InputError if the path is not a folder or the folder is not empty, IoError if it cannot be made. With
  // `force`, the folder may hold files: write() replaces those of the same name, and the destructor leaves them.
  explicit OutputFolder(const std::string& path, bool force = false);
  ~OutputFolder();
  OutputFolder(const OutputFolder&) = delete;
  OutputFolder& operator=(const OutputFolder&) = delete;

  // Makes a folder inside. Requires a name without '/'. Throws IoError.
  void makeFolder(const std::string& name);
  // Writes a file. Requires that its folder was made, and that the file was not written yet. Throws as Output does.
  void write(const std::string& name, std::string_view bytes);
  // Counts a file as made that the caller writes by other means. Requires that its folder was made.
  void note(const std::string& name) { made_.push_back(path_ + "/" + name); }
  // Keeps what was written.
  void finish() noexcept;

 private:
  std::string path_;
  std::vector<std::string> made_;  // files and folders, in the order in which they were made
};

// Turns `text` into a file name that is valid on every system: no characters that are special in a path, a shell or a
// terminal, not hidden, at most 180 bytes, never empty.
std::string safeFileName(const std::string& text);

// The n-th name is safeFileName() of the n-th text. A number is appended where an earlier name is equal in any letter
// case.
std::vector<std::string> safeFileNames(const std::vector<std::string>& texts);

}  // namespace filiform::tools
