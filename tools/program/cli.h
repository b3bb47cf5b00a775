// What every command line of the project shares: parsing, help, and one line and an exit code for each failure.
// Thread rule: call these once a process, on its main thread.
#pragma once

#include <functional>
#include <string>
#include <vector>

namespace CLI {
class App;
}

namespace filiform::tools {

// A command sets `chosen` when it was the one chosen; runProgram() calls it after parsing.
using Chosen = std::function<int()>;

// Parses, runs the chosen command, and maps every failure to one line on stderr and an exit code (tools/README.md has
// the table).
struct Program {
  std::string description, footer;  // of its help
  std::vector<void (*)(CLI::App& app, Chosen& chosen)> commands;
};
int runProgram(const Program& program, int argc, char** argv);

// From now on: memory that lacks where no exception may leave (libraries have such places) ends the program as it does
// elsewhere: zero force, one line on stderr, exit code 3.
void endPlainlyWithoutMemory();

}  // namespace filiform::tools
