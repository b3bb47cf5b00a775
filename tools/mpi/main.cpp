// filiform-mpi: commands of filiform by several processes together.
#include "tools/mpi/together.h"

int main(int argc, char** argv) { return filiform::tools::runTogether(argc, argv); }
