#include "tools/commands/commands.h"

int main(int argc, char** argv) { return filiform::tools::runFiliform(argc, argv); }
