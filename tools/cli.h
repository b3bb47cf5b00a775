// What all commands share: byte counts, numbers from people, signals, and the exit codes of a run.
// Thread rule: thread-compatible; the signal flag may be read by any thread.
#pragma once

#include <atomic>
#include <cstdint>
#include <functional>
#include <string>
#include <vector>

namespace filiform {
class TileStore;
}
namespace CLI {
class App;
}

namespace filiform::tools {

// Set by SIGINT and SIGTERM. Long work polls it.
const std::atomic<bool>& interruptFlag();
// Throws Interrupted (index/errors.h) once the flag is set.
void throwIfInterrupted();
// 128 + the signal that set the flag.
int interruptedExitCode();

// "65536", "64KiB", "1.5 MiB", "1G": K, M, G, T and KiB, MiB, GiB, TiB are powers of 1024; KB (kB), MB, GB, TB powers
// of 1000. Throws UsageError naming `option` and the forms.
std::uint64_t parseBytes(const std::string& option, const std::string& text);
// "64.0 MiB", "312 B".
std::string formatBytes(std::uint64_t bytes);
// 1234567 -> "1 234 567".
std::string formatCount(std::uint64_t count);
// Shortest decimals that read back as the same double.
std::string formatNumber(double value);
// A finite number in full; throws UsageError naming `what` otherwise (NaN, infinite, trailing text).
double parseNumber(const std::string& what, const std::string& text);

// From now on: memory that lacks where no exception may leave (libraries have such places) ends the program as it does
// elsewhere: zero force, one line on stderr, exit code 3.
void endPlainlyWithoutMemory();

// The cell of that name, or the only one whose name, else the only one whose source, has this text in it, in any letter
// case. Throws UsageError naming `option` (where the text was given) and up to five cells that the text fits, or up to
// three whose names are near. O(log cells) for a whole name, else O(cells).
std::uint32_t findCellNamed(const TileStore& store, const std::string& name, const std::string& option = "--cell");

// A command sets `chosen` when it was the one chosen; main calls it after parsing.
using Chosen = std::function<int()>;

void addSynth(CLI::App& app, Chosen& chosen);
void addCheck(CLI::App& app, Chosen& chosen);
void addIngest(CLI::App& app, Chosen& chosen);
void addInfo(CLI::App& app, Chosen& chosen);
void addCells(CLI::App& app, Chosen& chosen);
void addVerify(CLI::App& app, Chosen& chosen);
void addNearest(CLI::App& app, Chosen& chosen);
void addExport(CLI::App& app, Chosen& chosen);
void addNavigate(CLI::App& app, Chosen& chosen);
void addDevices(CLI::App& app, Chosen& chosen);
void addRender(CLI::App& app, Chosen& chosen);
void addView(CLI::App& app, Chosen& chosen);
void addLab(CLI::App& app, Chosen& chosen);       // `evaluate` and `bench`: starts filiform-lab
void addEvaluate(CLI::App& app, Chosen& chosen);  // of filiform-lab
void addBench(CLI::App& app, Chosen& chosen);     // of filiform-lab

// Parses, runs the chosen command, and maps every failure to one line on stderr and an exit code (tools/README.md has
// the table). Call once a process, on its main thread.
struct Program {
  std::string description, footer;  // of its help
  std::vector<void (*)(CLI::App& app, Chosen& chosen)> commands;
};
int runProgram(const Program& program, int argc, char** argv);
// filiform itself.
int runProgram(int argc, char** argv);

}  // namespace filiform::tools
