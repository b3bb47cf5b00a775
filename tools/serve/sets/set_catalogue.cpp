#include "tools/serve/sets/set_catalogue.h"

#include "index/remote/http_source.h"
#include "index/text.h"
#include "tools/serve/people/toml_file.h"
#include "tools/words/numbers.h"
#include "tools/words/token.h"

namespace filiform::tools {

std::vector<ShelfEntry> readCatalogue(const std::string& path, const RemoteOptions& remote) {
  const TomlFile file("--catalogue", path);
  std::vector<ShelfEntry> entries;
  for (const auto& [key, node] : file.tables()) {
    const std::string name(key.str());
    const toml::table* const table = node.as_table();
    if (table == nullptr) file.refuse(key.source(), "'" + escaped(name, 60) + "' is no table; give a set as [NAME]");
    ShelfEntry entry{name, {}, remote};
    for (const auto& [of, value] : *table) {
      const std::string what(of.str());
      if (what == "address") {
        const std::string given = file.text(what, value);
        entry.path = isAddress(given) ? given : file.beside(given);
      } else if (what == "token-file") {
        entry.remote.token = readTokenFile("token-file of " + name, file.beside(file.text(what, value)));
      } else if (what == "budget") {
        entry.budget_bytes = parseBytes("budget", file.text(what, value));
      } else if (what == "readers") {
        file.eachOf(what, value, [&](const toml::node& one) { entry.readers.push_back(file.text(what, one)); });
        if (entry.readers.empty())
          file.refuse(value, "readers is empty; give names, or leave readers out: then everybody may see the set");
      } else {
        file.refuse(of.source(),
                    "unknown key '" + escaped(what, 60) + "'; known are address, token-file, budget, readers");
      }
    }
    if (entry.path.empty() || name.empty())
      file.refuse(key.source(), "[" + escaped(name, 60) + "] needs a name and an address");
    entries.push_back(std::move(entry));
  }
  return entries;
}

}  // namespace filiform::tools
