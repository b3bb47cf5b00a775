// filiform bench, filiform evaluate: commands of a second program, filiform-lab, which replaces this process. Users of
// the other commands therefore never load the benchmarks.
#include "index/errors.h"
#include "tools/commands/commands.h"

#include <array>
#include <cerrno>
#include <cstring>
#include <fcntl.h>
#include <filesystem>
#include <iostream>
#include <memory>
#include <string>
#include <sys/wait.h>
#include <system_error>
#include <unistd.h>
#include <vector>

#include <CLI/CLI.hpp>
#include <nlohmann/json.hpp>

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
int startLab(const CLI::App& app, const std::string& command, std::vector<std::string> words) {
  words.insert(words.begin(), {kLab, command});
  if (app.get_config_ptr()->count() > 0)
    words.insert(words.end(), {"--config", app.get_config_ptr()->as<std::string>()});
  std::vector<char*> argv;
  for (std::string& word : words) argv.push_back(word.data());
  argv.push_back(nullptr);
  std::cout.flush();
  const std::string program = findLab();
  ::execvp(program.c_str(), argv.data());
  const int reason = errno;
  if (reason == ENOENT)
    throw IoError(
        kLab,
        "filiform " + command +
            " needs this program, but it is neither beside filiform nor in PATH; install the package "
            "filiform-lab, or build it: cmake --preset release -DFILIFORM_LAB=ON && cmake --build --preset release");
  throw IoError(program, "cannot start it", reason);
}

}  // namespace

std::string labUsage() {
  int ends[2];
  if (::pipe2(ends, O_CLOEXEC) != 0) return "";
  const std::string program = findLab();
  const std::array<const char*, 3> argv{kLab, "--json-usage", nullptr};
  const ::pid_t child = ::fork();
  if (child == 0) {
    ::dup2(ends[1], STDOUT_FILENO);
    ::execvp(program.c_str(), const_cast<char* const*>(argv.data()));
    ::_exit(127);
  }
  ::close(ends[1]);
  std::string text;
  std::array<char, 4096> block{};
  for (::ssize_t size = 0; child > 0 && (size = ::read(ends[0], block.data(), block.size())) > 0;)
    text.append(block.data(), static_cast<std::size_t>(size));
  ::close(ends[0]);
  int status = 0;
  if (child <= 0 || ::waitpid(child, &status, 0) != child || status != 0) return "";
  nlohmann::ordered_json commands = nlohmann::ordered_json::parse(text).at("commands");
  for (nlohmann::ordered_json& command : commands) command["program"] = kLab;
  return commands.dump();
}

void addLab(CLI::App& app, Chosen& chosen) {
  static constexpr std::array<std::array<const char*, 2>, 2> kCommands{
      {{"evaluate", "Compare all methods on the paper's scenes and on many routes"},
       {"bench", "Measure named workloads, with ratios to peers in the same run"}}};
  for (const auto& [name, summary] : kCommands) {
    CLI::App* command = app.add_subcommand(name, summary);
    command->set_help_flag();  // filiform-lab has the options
    command->prefix_command();
    command->callback([command, &app, &chosen] {
      chosen = [command, &app] { return startLab(app, command->get_name(), command->remaining()); };
    });
  }
}

}  // namespace filiform::tools
