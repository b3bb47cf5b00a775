// What the programs share: parsing the command line, help, and one line and an exit code for each failure.
// Thread rule: call each function once a process, on the main thread.
#pragma once

#include <functional>
#include <string>
#include <vector>

namespace CLI {
class App;
}

namespace filiform::tools {

// The chosen command sets `chosen` while the command line is parsed. runProgram() then calls it.
using Chosen = std::function<int()>;

// Parses the command line, runs the chosen command and returns the exit code. Every failure is one line on stderr and
// an exit code (table in tools/README.md).
struct Program {
  std::string description, footer;  // of the program's help
  std::vector<void (*)(CLI::App& app, Chosen& chosen)> commands;
  // For --json-usage: a JSON array with the commands of other programs (usage_json.h), empty if there are none. Null:
  // none.
  std::string (*others)() = nullptr;
  std::string name = "filiform";
};
int runProgram(const Program& program, int argc, char** argv);

// The options of a command that were given, in the command line, a variable or a file, such as "--zoom".
std::vector<std::string> givenOptions(const CLI::App& command);

// From now on, if memory runs out where a library must not throw, the program sets all forces to zero, prints one line
// on stderr and exits with code 3.
void endPlainlyWithoutMemory();

}  // namespace filiform::tools
