// Runs the program within the test's process, which takes a tenth of the time of a process of its own.
#pragma once

#include "tests/support/process.h"

#include <string>
#include <vector>

namespace filiform::test {

// Outcome::peak_bytes stays 0. Thread rule: one thread.
Outcome runHere(std::vector<std::string> words);

// A correct command line for each command of `filiform`, and files for them in the working folder: cell.swc, table.csv,
// points.txt, and set.fil with attributes. `serve` and `view` are left out: they do not end by themselves.
void makeInputs();
std::vector<std::vector<std::string>> goodCommands();

}  // namespace filiform::test
