// The file of --config: options by command, as TOML tables. tools/README.md states what is read. Thread rule:
// thread-compatible.
#pragma once

#include <string>
#include <vector>

namespace CLI {
class App;
}

namespace filiform::tools {

// Adds --config to the program. Values of the command line and of the environment win over those of
// the file. Requires that all commands are added. While the command line is parsed, a file with an unknown command or
// option gives UsageError.
void addConfigFile(CLI::App& app);

// The words of a command line with --config and its file first, so that --config may stand behind the command.
std::vector<std::string> withConfigFirst(std::vector<std::string> words);

}  // namespace filiform::tools
