// filiform bench, filiform evaluate: commands of a second program, filiform-lab, which replaces this process. Users of
// the other commands therefore never load the benchmarks.
#include "index/errors.h"
#include "tools/commands/commands.h"

#include <array>
#include <cerrno>
#include <cstring>
#include <filesystem>
#include <iostream>
#include <memory>
#include <string>
#include <system_error>
#include <unistd.h>
#include <vector>

#include <CLI/CLI.hpp>

namespace filiform::tools {

namespace {

constexpr const char* kLab = "filiform-lab";

// The program beside this one, else the one in PATH.
std::string findLab() {
  std::error_code error;
  const std::filesystem::path own = std::filesystem::read_symlink("/proc/self/exe", error);
  if (!error) {
    const std::filesystem::path beside = own.parent_path() / kLab;
    if (std::filesystem::exists(beside, error)) return beside.string();
  }
  return kLab;
}

// Returns only if the program cannot be started; then throws IoError.
int startLab(const std::string& command, std::vector<std::string> words) {
  words.insert(words.begin(), {kLab, command});
  std::vector<char*> argv;
  for (std::string& word : words) argv.push_back(word.data());
  argv.push_back(nullptr);
  std::cout.flush();
  const std::string program = findLab();
  ::execvp(program.c_str(), argv.data());
  const int reason = errno;
  if (reason == ENOENT)
    throw IoError(kLab, "filiform " + command + " needs this program, but it is neither beside filiform nor in PATH");
  throw IoError(program, "cannot start it", reason);
}

}  // namespace

void addLab(CLI::App& app, Chosen& chosen) {
  static constexpr std::array<std::array<const char*, 2>, 2> kCommands{
      {{"evaluate", "Compare all methods on the paper's scenes and on many routes"},
       {"bench", "Measure named workloads, with ratios to peers in the same run"}}};
  for (const auto& [name, summary] : kCommands) {
    CLI::App* command = app.add_subcommand(name, summary);
    command->set_help_flag();  // filiform-lab has the options
    command->prefix_command();
    command->callback(
        [command, &chosen] { chosen = [command] { return startLab(command->get_name(), command->remaining()); }; });
  }
}

}  // namespace filiform::tools
