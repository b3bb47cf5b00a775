// Runs the program as a process and returns its output.
#pragma once

#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

namespace filiform::test {

struct Outcome {
  int exit_code = -1;  // 128 + signal if a signal killed it
  std::string out, err;
  // Peak memory, bytes; at least the memory of the calling process at the start.
  std::uint64_t peak_bytes = 0;
  bool oneLineOnStderr() const { return !err.empty() && err.find('\n') == err.size() - 1; }
};

// Runs `filiform ARGS...` with `input` on stdin and waits for its end. Throws std::runtime_error if it cannot be
// started.
Outcome runFiliform(const std::vector<std::string>& arguments, const std::string& input = "");

// The same inside a shell line. "$@" stands for the program and its arguments, for example
// "ulimit -f 10; exec \"$@\"".
Outcome runFiliformInShell(const std::string& line, const std::vector<std::string>& arguments);

// The output of `navigate --json` without its requests, which only a set at an address has. Other text stays.
std::string withoutNetwork(const std::string& text);

// The program under test, as built beside the tests.
std::filesystem::path filiformProgram();

}  // namespace filiform::test
