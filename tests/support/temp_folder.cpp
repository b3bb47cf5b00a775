#include "tests/support/temp_folder.h"

#include <filesystem>
#include <fstream>
#include <stdexcept>
#include <stdlib.h>
#include <unistd.h>

namespace filiform::test {

TempFolder::TempFolder() {
  // In memory if possible, because publishing a set flushes every file, which takes most of a test's time on a disk.
  std::error_code ignored;
  const std::filesystem::path memory("/dev/shm");
  const bool have_memory =
      ::access(memory.c_str(), W_OK) == 0 && std::filesystem::space(memory, ignored).available > (64u << 20);
  const std::filesystem::path base = have_memory ? memory : std::filesystem::temp_directory_path();
  std::string name = (base / "filiform-test-XXXXXX").string();
  if (::mkdtemp(name.data()) == nullptr) throw std::runtime_error(name + ": cannot be created");
  path_ = name;
}

TempFolder::~TempFolder() {
  std::error_code ignored;
  std::filesystem::remove_all(path_, ignored);
}

std::string readBytes(const std::string& path) {
  std::ifstream in(path, std::ios::binary);
  if (!in) throw std::runtime_error(path + ": cannot be read");
  std::string bytes, block(std::size_t{1} << 16, '\0');
  do {
    in.read(block.data(), static_cast<std::streamsize>(block.size()));
    bytes.append(block, 0, static_cast<std::size_t>(in.gcount()));
  } while (in);
  return bytes;
}

void writeBytes(const std::string& path, const std::string& bytes) {
  std::ofstream out(path, std::ios::binary | std::ios::trunc);
  out << bytes;
  out.close();
  if (!out) throw std::runtime_error(path + ": cannot be written");
}

void writeBelow(const TempFolder& folder, const std::string& name, const std::string& bytes) {
  const std::string path = folder / name;
  std::filesystem::create_directories(std::filesystem::path(path).parent_path());
  writeBytes(path, bytes);
}

}  // namespace filiform::test
