// A temporary folder, removed with its content at the end of the test.
#pragma once

#include <string>

namespace filiform::test {

class TempFolder {
 public:
  TempFolder();
  TempFolder(const TempFolder&) = delete;
  TempFolder& operator=(const TempFolder&) = delete;
  ~TempFolder();

  const std::string& path() const { return path_; }
  std::string operator/(const std::string& name) const { return path_ + "/" + name; }
  std::string file(const std::string& name) const { return *this / name; }

 private:
  std::string path_;
};

std::string readBytes(const std::string& path);
void writeBytes(const std::string& path, const std::string& bytes);
// Writes the file `name`, a path below the folder, and makes the folders on its way.
void writeBelow(const TempFolder& folder, const std::string& name, const std::string& bytes);

}  // namespace filiform::test
