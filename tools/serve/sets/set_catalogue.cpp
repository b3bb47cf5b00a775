#include "tools/serve/sets/set_catalogue.h"

#include "index/errors.h"
#include "index/remote/http_source.h"
#include "index/text.h"
#include "tools/words/numbers.h"
#include "tools/words/token.h"

#include <cerrno>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <toml++/toml.h>

namespace filiform::tools {

namespace {

UsageError wrongCatalogue(const std::string& path, const toml::source_region& where, const std::string& what) {
  return UsageError("--catalogue " + inShort(path) + ", line " + std::to_string(where.begin.line) + ": " + what);
}

}  // namespace

std::vector<ShelfEntry> readCatalogue(const std::string& path, const RemoteOptions& remote) {
  std::ifstream file(path, std::ios::binary);
  const std::string text{std::istreambuf_iterator<char>(file), {}};
  if (!file.is_open() || file.bad()) throw IoError(path, "cannot be read", errno);
  toml::table tables;
  try {
    tables = toml::parse(text);
  } catch (const toml::parse_error& error) {
    throw wrongCatalogue(path, error.source(), escaped(error.description(), 200));
  }
  const auto beside = [&](const std::string& given) {
    return (std::filesystem::path(path).parent_path() / given).lexically_normal().string();
  };
  std::vector<ShelfEntry> entries;
  for (const auto& [key, node] : tables) {
    const std::string name(key.str());
    const toml::table* const table = node.as_table();
    if (table == nullptr)
      throw wrongCatalogue(path, key.source(), "'" + escaped(name, 60) + "' is no table; give a set as [NAME]");
    ShelfEntry entry{name, {}, remote};
    for (const auto& [of, value] : *table) {
      const auto given = value.value<std::string>();
      if (!given)
        throw wrongCatalogue(path, of.source(), "'" + escaped(of.str(), 60) + "' must be a text in quotation marks");
      if (of == "address")
        entry.path = isAddress(*given) ? *given : beside(*given);
      else if (of == "token-file")
        entry.remote.token = readTokenFile("token-file of " + name, beside(*given));
      else if (of == "budget")
        entry.budget_bytes = parseBytes("budget", *given);
      else
        throw wrongCatalogue(path, of.source(),
                             "unknown key '" + escaped(of.str(), 60) + "'; known are address, token-file, budget");
    }
    if (entry.path.empty() || name.empty())
      throw wrongCatalogue(path, key.source(), "[" + escaped(name, 60) + "] needs a name and an address");
    entries.push_back(std::move(entry));
  }
  return entries;
}

}  // namespace filiform::tools
