#include "tools/words/making/output_folder.h"

#include "index/errors.h"
#include "index/output.h"
#include "index/text.h"

#include <algorithm>
#include <cerrno>
#include <filesystem>
#include <map>
#include <set>
#include <sys/stat.h>
#include <system_error>

namespace filiform::tools {

namespace {

namespace fs = std::filesystem;

constexpr std::size_t kLongestName = 180;  // bytes; file systems allow 255, and endings and numbers are appended

}  // namespace

OutputFolder::OutputFolder(const std::string& path, bool force) : path_(path) {
  while (path_.size() > 1 && path_.back() == '/') path_.pop_back();
  std::error_code error;
  const fs::file_status status = fs::status(path_, error);
  if (fs::is_directory(status)) {
    if (!force && (!fs::is_empty(path_, error) || error))
      throw InputError(inShort(path_) + ": is a folder that is not empty; name a new or an empty one");
    return;
  }
  if (fs::exists(status)) throw InputError(inShort(path_) + ": is not a folder; choose another name");
  refuseInputName(path_);
  if (::mkdir(path_.c_str(), 0777) != 0) throw IoError(inShort(path_), "cannot make the folder", errno);
  made_.push_back(path_);
}

OutputFolder::~OutputFolder() {
  std::error_code ignored;
  for (auto made = made_.rbegin(); made != made_.rend(); ++made) fs::remove(*made, ignored);
}

void OutputFolder::makeFolder(const std::string& name) {
  const std::string path = path_ + "/" + name;
  if (::mkdir(path.c_str(), 0777) != 0) throw IoError(inShort(path), "cannot make the folder", errno);
  made_.push_back(path);
}

void OutputFolder::write(const std::string& name, std::string_view bytes) {
  Output out(path_ + "/" + name, {.sync = false});
  out.write(bytes);
  std::error_code error;
  if (!fs::exists(fs::symlink_status(out.path(), error))) made_.push_back(out.path());
  out.finish();
}

void OutputFolder::finish() noexcept { made_.clear(); }

std::string safeFileName(const std::string& text) {
  const bool keep_utf8 = isUtf8(text);
  std::string name = escaped(text, kLongestName);  // cut at a whole character
  if (name.size() > kLongestName) name.resize(kLongestName);
  if (!isUtf8(name) || !keep_utf8)
    for (char& c : name)
      if (static_cast<unsigned char>(c) >= 0x80) c = '_';
  for (char& c : name)
    if (static_cast<unsigned char>(c) <= 0x20 || c == 0x7f ||
        std::string_view("/\\:*?\"<>|$`'&;!").find(c) != std::string_view::npos)
      c = '_';
  if (!name.empty() && (name.front() == '.' || name.front() == '-')) name.front() = '_';
  while (!name.empty() && name.back() == '.') name.back() = '_';
  return name.empty() ? "cell" : name;
}

std::vector<std::string> safeFileNames(const std::vector<std::string>& texts) {
  std::vector<std::string> names;
  std::set<std::string> taken;
  std::map<std::string, int> next;  // the number to append to a name, less 1
  for (const std::string& text : texts) {
    const std::string safe = safeFileName(text);
    std::string name = safe;
    next.try_emplace(lowerCase(safe), 1);
    for (int& n = next[lowerCase(safe)]; !taken.insert(lowerCase(name)).second;)
      name = safe + "-" + std::to_string(++n);
    names.push_back(name);
  }
  return names;
}

}  // namespace filiform::tools
