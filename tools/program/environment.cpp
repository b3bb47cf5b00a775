#include "tools/program/environment.h"

#include "index/text.h"

#include <algorithm>
#include <array>
#include <cstdlib>

#include <CLI/CLI.hpp>

namespace filiform::tools {

namespace {

struct Variable {
  const char *option, *name;
};
constexpr std::array<Variable, 3> kVariables{
    {{"--threads", "FILIFORM_THREADS"}, {"--memory", "FILIFORM_MEMORY"}, {"--cache", "FILIFORM_CACHE"}}};

}  // namespace

void addEnvironment(CLI::App& app) {
  for (CLI::App* command : app.get_subcommands([](CLI::App*) { return true; }))
    for (const Variable& variable : kVariables)
      if (CLI::Option* const option = command->get_option_no_throw(variable.option)) option->envname(variable.name);
}

std::string originOf(const CLI::App& app, const std::string& message, const std::vector<std::string>& words) {
  for (const CLI::App* command : app.get_subcommands())
    for (const CLI::Option* option : command->get_options()) {
      if (option->count() == 0) continue;
      const std::string name = option->get_name();
      const bool given = std::any_of(words.begin(), words.end(), [&](const std::string& word) {
        return word == name || word.starts_with(name + "=");
      });
      if (given || message.find(name) == std::string::npos) continue;
      const std::string& variable = option->get_envname();
      const char* const value = variable.empty() ? nullptr : std::getenv(variable.c_str());
      if (value != nullptr && *value != '\0') return " (from the variable " + variable + ")";
      const CLI::Option* const config = app.get_config_ptr();
      if (config != nullptr && config->count() > 0) return " (from " + escaped(config->as<std::string>(), 200) + ")";
    }
  return "";
}

}  // namespace filiform::tools
