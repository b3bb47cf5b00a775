#include "tools/commands/commands.h"

int main(int argc, char** argv) { return filiform::tools::runCommands(argc, argv); }
