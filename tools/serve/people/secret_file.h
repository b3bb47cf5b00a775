// SecretFile: a file with secrets that is read again when it changes. Thread rule: one thread at a time.
#pragma once

#include <ctime>
#include <functional>
#include <optional>
#include <string>
#include <sys/types.h>
#include <tuple>

namespace filiform::tools {

class SecretFile {
 public:
  // `option`: the one that names the file; `path` may be empty: no file.
  SecretFile(std::string option, std::string path);
  const std::string& option() const { return option_; }
  const std::string& path() const { return path_; }
  // True if the file is another one than at the last call; false at the first call, and while there is no file. Tells a
  // line, for each such change, if all users of the machine may read the file.
  bool hasChanged(const std::function<void(const std::string& line)>& tell);

 private:
  const std::string option_, path_;
  std::optional<std::tuple<std::time_t, long, ino_t, mode_t>> known_;
};

}  // namespace filiform::tools
