// The commands of `filiform-lab`.
#pragma once

#include "tools/program/cli.h"

namespace filiform::tools {

void addEvaluate(CLI::App& app, Chosen& chosen);
void addBench(CLI::App& app, Chosen& chosen);

}  // namespace filiform::tools
