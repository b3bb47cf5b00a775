// A folder that a command fills with files. Thread rule: thread-compatible.
#pragma once

#include <string>
#include <string_view>
#include <vector>

namespace filiform::tools {

// The folder is made, or is there and empty. Without finish() everything that was made is removed again.
class OutputFolder {
 public:
  // Throws InputError where the path is no folder or holds anything, IoError where it cannot be made.
  explicit OutputFolder(const std::string& path);
  ~OutputFolder();
  OutputFolder(const OutputFolder&) = delete;
  OutputFolder& operator=(const OutputFolder&) = delete;

  // Makes a folder in it. Requires a name without '/'. Throws IoError.
  void makeFolder(const std::string& name);
  // Writes a file. Requires a name whose folder was made, and that was not written yet. Throws as Output does.
  void write(const std::string& name, std::string_view bytes);
  // What was written stays. Throws nothing.
  void finish() noexcept;

 private:
  std::string path_;
  std::vector<std::string> made_;  // in order; folders among them
};

// `text` as the name of a file on any system: without what steers a path, a shell or a terminal, not hidden, at most
// 180 bytes. Never empty.
std::string safeFileName(const std::string& text);

// The n-th of these names is safeFileName() of the n-th text, made different from those before it in any letter case.
std::vector<std::string> safeFileNames(const std::vector<std::string>& texts);

}  // namespace filiform::tools
