// The commands of `filiform`. Each is one source, cmd_NAME.cpp; commands.cpp lists them. Thread rule: as cli.h.
#pragma once

#include "index/ranks/ranks.h"
#include "tools/program/cli.h"

#include <functional>
#include <string>

namespace filiform::tools {

void addSynth(CLI::App& app, Chosen& chosen);
void addCheck(CLI::App& app, Chosen& chosen);
void addFix(CLI::App& app, Chosen& chosen);
void addIngest(CLI::App& app, Chosen& chosen);
// For a program of several processes: `around` runs the command, and tells other ranks if it fails.
using Around = std::function<int(const std::function<int()>& run)>;
void addIngestTogether(CLI::App& app, Chosen& chosen, Ranks& ranks, const Around& around);
void addCheckTogether(CLI::App& app, Chosen& chosen, Ranks& ranks, const Around& around);
void addNearestTogether(CLI::App& app, Chosen& chosen, Ranks& ranks, const Around& around);
void addAttributes(CLI::App& app, Chosen& chosen);
void addCompact(CLI::App& app, Chosen& chosen);
void addPush(CLI::App& app, Chosen& chosen);
void addPull(CLI::App& app, Chosen& chosen);
void addTidy(CLI::App& app, Chosen& chosen);
void addInfo(CLI::App& app, Chosen& chosen);
void addCells(CLI::App& app, Chosen& chosen);
void addMeasure(CLI::App& app, Chosen& chosen);
void addContacts(CLI::App& app, Chosen& chosen);
void addCompare(CLI::App& app, Chosen& chosen);
void addVerify(CLI::App& app, Chosen& chosen);
void addNearest(CLI::App& app, Chosen& chosen);
void addPath(CLI::App& app, Chosen& chosen);
void addExport(CLI::App& app, Chosen& chosen);
void addNavigate(CLI::App& app, Chosen& chosen);
void addDevices(CLI::App& app, Chosen& chosen);
void addRender(CLI::App& app, Chosen& chosen);
void addView(CLI::App& app, Chosen& chosen);
void addReplay(CLI::App& app, Chosen& chosen);
void addServe(CLI::App& app, Chosen& chosen);
void addLab(CLI::App& app, Chosen& chosen);  // `evaluate` and `bench`: start filiform-lab

// The commands of filiform-lab for --json-usage: a JSON array, empty if the program is not there.
std::string labUsage();

// Runs `filiform` and returns its exit code.
int runCommands(int argc, char** argv);

}  // namespace filiform::tools
