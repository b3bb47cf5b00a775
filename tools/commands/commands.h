// The commands of `filiform`. Each is one source, cmd_NAME.cpp; commands.cpp lists them. Thread rule: as cli.h.
#pragma once

#include "tools/program/cli.h"

namespace filiform::tools {

void addSynth(CLI::App& app, Chosen& chosen);
void addCheck(CLI::App& app, Chosen& chosen);
void addIngest(CLI::App& app, Chosen& chosen);
void addCompact(CLI::App& app, Chosen& chosen);
void addInfo(CLI::App& app, Chosen& chosen);
void addCells(CLI::App& app, Chosen& chosen);
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

// Runs `filiform` and returns its exit code.
int runFiliform(int argc, char** argv);

}  // namespace filiform::tools
