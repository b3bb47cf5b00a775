// Describes the commands and options of a program as JSON, for man pages, completion and wrappers. tools/README.md
// lists the fields. Thread rule: functions without state.
#pragma once

#include <string>

namespace CLI {
class App;
}

namespace filiform::tools {

// The text of `--json-usage`, one JSON object. `others`: a JSON array of commands of other programs, as this function
// gives them; they replace commands of the same name. Empty: none. Requires that all commands are added.
std::string usageJson(const CLI::App& app, const std::string& version, const std::string& others = {});

}  // namespace filiform::tools
