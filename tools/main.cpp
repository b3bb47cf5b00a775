#include "tools/cli.h"

int main(int argc, char** argv) { return filiform::tools::runProgram(argc, argv); }
