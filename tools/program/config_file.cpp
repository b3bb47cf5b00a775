#include "tools/program/config_file.h"

#include "index/errors.h"
#include "index/text.h"
#include "tools/words/near_names.h"

#include <algorithm>
#include <cstdlib>
#include <istream>
#include <memory>
#include <string>
#include <vector>

#include <CLI/CLI.hpp>

namespace filiform::tools {

namespace {

// Passes on the options of the chosen command that neither the command line nor the environment gives.
class CommandTables : public CLI::ConfigTOML {
 public:
  explicit CommandTables(const CLI::App& app) : app_(app) {}

  std::vector<CLI::ConfigItem> from_config(std::istream& in) const override {
    std::vector<CLI::ConfigItem> used;
    for (CLI::ConfigItem& item : CLI::ConfigTOML::from_config(in)) {
      if (item.name == "++" || item.name == "--") continue;  // a table begins or ends
      if (item.parents.size() != 1)
        throw UsageError(place() + "'" + escaped(item.fullname(), 80) +
                         "' is in no table of a command; write [ingest] above the options of ingest");
      const CLI::App* const command = commandOf(item.parents[0]);
      if (command->get_prefix_command()) continue;  // the other program reads its own tables
      const CLI::Option& option = optionOf(*command, item.name);
      const bool is_set = option.count() > 0 || isInEnvironment(option);
      if (!app_.got_subcommand(command) || is_set) continue;
      used.push_back(std::move(item));
    }
    return used;
  }

 private:
  std::string place() const { return "--config " + escaped(app_.get_config_ptr()->as<std::string>(), 200) + ": "; }
  static bool isInEnvironment(const CLI::Option& option) {
    const std::string& variable = option.get_envname();
    const char* const value = variable.empty() ? nullptr : std::getenv(variable.c_str());
    return value != nullptr && *value != '\0';
  }
  const CLI::App* commandOf(const std::string& name) const {
    NearNames near(name);
    for (const CLI::App* command : app_.get_subcommands([](const CLI::App*) { return true; })) {
      if (command->get_name() == name) return command;
      near.offer(command->get_name());
    }
    throw UsageError(place() + "[" + escaped(name, 80) + "] is no command" + didYouMean(near.names()));
  }
  const CLI::Option& optionOf(const CLI::App& command, const std::string& name) const {
    NearNames near(name);
    for (const CLI::Option* option : command.get_options()) {
      for (const std::string& long_name : option->get_lnames()) {
        if (long_name == name && option->get_configurable()) return *option;
        near.offer(long_name);
      }
    }
    throw UsageError(place() + "'" + escaped(name, 80) + "' is no option of " + command.get_name() +
                     didYouMean(near.names()));
  }

  const CLI::App& app_;
};

}  // namespace

void addConfigFile(CLI::App& app) {
  app.set_config("--config", "", "read options from this file, in a table for each command: [ingest] threads = 2")
      ->type_name("FILE");
  app.config_formatter(std::make_shared<CommandTables>(app));
}

std::vector<std::string> withConfigFirst(std::vector<std::string> words) {
  const auto end = std::find(words.begin(), words.end(), "--");
  const auto config = std::find_if(
      words.begin(), end, [](const std::string& word) { return word == "--config" || word.starts_with("--config="); });
  if (config == end) return words;
  const auto after = config + (*config == "--config" && config + 1 != end ? 2 : 1);
  std::rotate(words.begin(), config, after);
  return words;
}

}  // namespace filiform::tools
