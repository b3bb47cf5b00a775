#include "tools/commands/commands.h"

namespace filiform::tools {

int runCommands(int argc, char** argv) {
  static const Program kFiliform{
      "filiform: navigation through whole neuronal columns by hand.",
      "Start here:\n  filiform synth demo.zip --cells 20 --seed 1\n  filiform ingest demo.zip -o demo.fil\n"
      "  filiform view demo.fil\n'filiform COMMAND --help' has an example for each command.",
      {addSynth,    addCheck,   addFix,     addIngest,   addAttributes, addCompact, addPush,    addPull, addTidy,
       addInfo,     addCells,   addMeasure, addContacts, addCompare,    addVerify,  addNearest, addPath, addExport,
       addNavigate, addDevices, addRender,  addView,     addServe,      addReplay,  addLab},
      labUsage};
  return runProgram(kFiliform, argc, argv);
}

}  // namespace filiform::tools
