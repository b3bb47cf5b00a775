// The oracle of the basic and the force-based solver: the literal transcription that the benchmark also uses.
#pragma once

#include "tools/lab/reference/literal_solver.h"

namespace filiform::test {

using tools::WholeGraph;
using PaperOracle = tools::LiteralSolver;

}  // namespace filiform::test
