// runTogether: the program filiform-mpi. Thread rule: call it once a process, on the main thread.
#pragma once

namespace filiform::tools {

// Starts MPI, parses the command line, runs the command together with the other ranks, and returns the exit code. Rank
// 0 alone writes to standard output and standard error.
int runTogether(int argc, char** argv);

}  // namespace filiform::tools
