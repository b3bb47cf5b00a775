// TomlFile: a file of settings in TOML, whose mistakes are told with their line. Thread rule: immutable.
#pragma once

#include <functional>
#include <string>
#include <toml++/toml.h>

namespace filiform::tools {

class TomlFile {
 public:
  // `option`: the one that names the file, for messages. Throws IoError if the file cannot be read, and UsageError if
  // it is no TOML.
  TomlFile(std::string option, const std::string& path);

  const toml::table& tables() const { return tables_; }
  // Throws UsageError that names option, file and line.
  [[noreturn]] void refuse(const toml::source_region& where, const std::string& what) const;
  [[noreturn]] void refuse(const toml::node& where, const std::string& what) const { refuse(where.source(), what); }
  // A text; refuses another value.
  std::string text(const std::string& key, const toml::node& value) const;
  // Calls `use` for each element of a list; refuses another value.
  void eachOf(const std::string& key, const toml::node& value, const std::function<void(const toml::node&)>& use) const;
  // A path of the file, which begins at the folder of the file if it is relative.
  std::string beside(const std::string& path) const;

 private:
  const std::string option_, path_;
  toml::table tables_;
};

}  // namespace filiform::tools
