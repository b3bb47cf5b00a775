#include "tools/serve/people/secret_file.h"

#include "index/text.h"

#include <sys/stat.h>
#include <utility>

namespace filiform::tools {

SecretFile::SecretFile(std::string option, std::string path) : option_(std::move(option)), path_(std::move(path)) {}

bool SecretFile::hasChanged(const std::function<void(const std::string&)>& tell) {
  struct stat found {};
  if (path_.empty() || ::stat(path_.c_str(), &found) != 0) return false;
  const std::tuple state(found.st_mtim.tv_sec, found.st_mtim.tv_nsec, found.st_ino, found.st_mode);
  const bool first = !known_;
  if (known_ == state) return false;
  known_ = state;
  if ((found.st_mode & S_IROTH) != 0)
    tell(option_ + " " + inShort(path_) + ": all users of this machine may read it; chmod 600 it");
  return !first;
}

}  // namespace filiform::tools
