// Environment variables that give options: FILIFORM_THREADS, FILIFORM_MEMORY, FILIFORM_CACHE. Thread rule: as cli.h.
#pragma once

#include <string>
#include <vector>

namespace CLI {
class App;
}

namespace filiform::tools {

// Gives every --threads, --memory and --cache of the commands its variable. An option on the command line wins.
// Requires that all commands are added.
void addEnvironment(CLI::App& app);

// For a message about a refused value: " (from the variable FILIFORM_THREADS)" if the message names an option that
// comes from a variable, " (from f.toml)" if it comes from the file of --config, otherwise "". `words`: of the command
// line.
std::string originOf(const CLI::App& app, const std::string& message, const std::vector<std::string>& words);

}  // namespace filiform::tools
