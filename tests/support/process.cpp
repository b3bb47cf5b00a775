#include "tests/support/process.h"

#include <array>
#include <cerrno>
#include <cstdio>
#include <memory>
#include <regex>
#include <stdexcept>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

namespace filiform::test {

namespace {

using File = std::unique_ptr<std::FILE, int (*)(std::FILE*)>;

std::string readBack(std::FILE* file) {
  std::rewind(file);
  std::string text;
  std::array<char, 4096> buffer;
  while (const std::size_t n = std::fread(buffer.data(), 1, buffer.size(), file)) text.append(buffer.data(), n);
  return text;
}

Outcome runCommand(const std::vector<std::string>& command, const std::string& input) {
  const File in(std::tmpfile(), std::fclose), out(std::tmpfile(), std::fclose), err(std::tmpfile(), std::fclose);
  if (!in || !out || !err) throw std::runtime_error("cannot make temporary files");
  std::fwrite(input.data(), 1, input.size(), in.get());
  std::rewind(in.get());
  std::fflush(in.get());

  std::vector<char*> argv;
  for (const std::string& word : command) argv.push_back(const_cast<char*>(word.c_str()));
  argv.push_back(nullptr);
  const pid_t child = fork();
  if (child < 0) throw std::runtime_error("cannot fork");
  if (child == 0) {
    dup2(fileno(in.get()), 0);
    dup2(fileno(out.get()), 1);
    dup2(fileno(err.get()), 2);
    execvp(argv[0], argv.data());
    _exit(127);
  }
  int status = 0;
  rusage used{};
  while (wait4(child, &status, 0, &used) < 0)
    if (errno != EINTR) throw std::runtime_error("cannot wait");
  Outcome outcome;
  outcome.exit_code = WIFEXITED(status) ? WEXITSTATUS(status) : 128 + WTERMSIG(status);
  outcome.peak_bytes = static_cast<std::uint64_t>(used.ru_maxrss) << 10;
  outcome.out = readBack(out.get());
  outcome.err = readBack(err.get());
  return outcome;
}

}  // namespace

std::filesystem::path filiformProgram() {
  return std::filesystem::read_symlink("/proc/self/exe").parent_path() / "filiform";
}

Outcome runFiliform(const std::vector<std::string>& arguments, const std::string& input) {
  std::vector<std::string> command{filiformProgram().string()};
  command.insert(command.end(), arguments.begin(), arguments.end());
  return runCommand(command, input);
}

Outcome runFiliformInShell(const std::string& line, const std::vector<std::string>& arguments) {
  std::vector<std::string> command{"bash", "-c", line, "bash", filiformProgram().string()};
  command.insert(command.end(), arguments.begin(), arguments.end());
  return runCommand(command, "");
}

std::string withoutNetwork(const std::string& text) {
  static const std::regex kNetwork("\"network\": (null|[{][^}]*[}])");
  return std::regex_replace(text, kNetwork, "");
}

}  // namespace filiform::test
