#include "tools/lab/lab_commands.h"

int main(int argc, char** argv) {
  using namespace filiform::tools;
  return runProgram({"filiform-lab: evaluates and measures filiform.",
                     "'filiform bench' and 'filiform evaluate' start this program.",
                     {addEvaluate, addBench}},
                    argc, argv);
}
