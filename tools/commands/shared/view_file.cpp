#include "tools/commands/shared/view_file.h"

#include "index/errors.h"
#include "index/text.h"

#include <cerrno>
#include <filesystem>
#include <fstream>
#include <iostream>
#include <iterator>

namespace filiform::tools {

ViewState readViewFile(const std::string& path) {
  constexpr std::uintmax_t kMostBytes = 64U << 20;
  std::error_code error;
  const std::uintmax_t bytes = std::filesystem::file_size(path, error);
  if (error) throw IoError("--view " + inShort(path), "cannot read", error.value());
  if (bytes > kMostBytes) throw InputError("--view " + inShort(path) + ": more than 64 MiB; no view is so large");
  std::ifstream in(path, std::ios::binary);
  if (!in) throw IoError("--view " + inShort(path), "cannot open", errno);
  const std::string text{std::istreambuf_iterator<char>(in), std::istreambuf_iterator<char>()};
  if (in.bad() || !in) throw IoError("--view " + inShort(path), "cannot read");
  std::vector<std::string> notes;
  ViewState view = viewStateOf(text, "--view " + path, notes);
  for (const std::string& note : notes) std::cerr << "filiform: note: " << note << '\n';
  return view;
}

}  // namespace filiform::tools
