#include "tools/serve/people/toml_file.h"

#include "index/errors.h"
#include "index/text.h"

#include <cerrno>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <utility>

namespace filiform::tools {

TomlFile::TomlFile(std::string option, const std::string& path) : option_(std::move(option)), path_(path) {
  std::ifstream file(path, std::ios::binary);
  const std::string text{std::istreambuf_iterator<char>(file), {}};
  if (!file.is_open() || file.bad()) throw IoError(option_ + " " + inShort(path), "cannot be read", errno);
  try {
    tables_ = toml::parse(text);
  } catch (const toml::parse_error& error) {
    refuse(error.source(), escaped(error.description(), 200));
  }
}

void TomlFile::refuse(const toml::source_region& where, const std::string& what) const {
  throw UsageError(option_ + " " + inShort(path_) + ", line " + std::to_string(where.begin.line) + ": " + what);
}

std::string TomlFile::text(const std::string& key, const toml::node& value) const {
  const auto given = value.value<std::string>();
  if (!given) refuse(value, "'" + escaped(key, 60) + "' must be a text in quotation marks");
  return *given;
}

void TomlFile::eachOf(const std::string& key, const toml::node& value,
                      const std::function<void(const toml::node&)>& use) const {
  if (!value.is_array()) refuse(value, "'" + escaped(key, 60) + "' must be a list, such as [\"a\", \"b\"]");
  for (const toml::node& one : *value.as_array()) use(one);
}

std::string TomlFile::beside(const std::string& path) const {
  return (std::filesystem::path(path_).parent_path() / path).lexically_normal().string();
}

}  // namespace filiform::tools
