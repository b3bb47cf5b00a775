#include "tests/support/run_here.h"

#include "tests/support/temp_folder.h"
#include "tools/commands/commands.h"

#include <filesystem>
#include <iostream>
#include <sstream>

namespace filiform::test {

Outcome runHere(std::vector<std::string> words) {
  words.insert(words.begin(), "filiform");
  std::vector<char*> argv;
  for (std::string& word : words) argv.push_back(word.data());
  argv.push_back(nullptr);
  std::ostringstream out, err;
  std::streambuf* const out_before = std::cout.rdbuf(out.rdbuf());
  std::streambuf* const err_before = std::cerr.rdbuf(err.rdbuf());
  Outcome outcome;
  outcome.exit_code = tools::runCommands(static_cast<int>(words.size()), argv.data());
  std::cout.rdbuf(out_before);
  std::cerr.rdbuf(err_before);
  outcome.out = out.str();
  outcome.err = err.str();
  return outcome;
}

void makeInputs() {
  writeBytes("cell.swc", "1 1 0 0 0 5 -1\n2 3 10 0 0 1 1\n3 3 20 0 0 1 2\n4 3 30 5 0 1 3\n");
  writeBytes("table.csv", "name,layer,cell_type\ncell,4,Tm3\n");
  writeBytes("points.txt", "1 2 3\n");
  runHere({"ingest", "cell.swc", "-o", "set.fil", "--attributes", "table.csv", "--key", "name"});
}

std::vector<std::vector<std::string>> goodCommands() {
  return {{"check", "cell.swc"},
          {"fix", "cell.swc", "-o", "fixed/", "--force"},
          {"ingest", "cell.swc", "-o", "new.fil"},
          {"compact", "set.fil"},
          {"push", "nowhere.fil", "s3://bucket/name.fil"},
          {"pull", "nowhere", "-o", "new.fil"},
          {"tidy", "nowhere", "--yes"},
          {"info", "set.fil"},
          {"cells", "set.fil"},
          {"measure", "set.fil"},
          {"contacts", "set.fil", "--within", "1"},
          {"compare", "set.fil", "cell.swc"},
          {"verify", "set.fil"},
          {"nearest", "set.fil", "1", "2", "3"},
          {"path", "set.fil", "cell:1", "cell:2"},
          {"export", "set.fil", "--cell", "cell", "-o", "out.swc"},
          {"synth", "new.zip", "--cells", "1"},
          {"navigate", "set.fil", "--seconds", "0.01"},
          {"replay", "set.fil", "nowhere.rec"},
          {"devices", "--test", "joystick"}};
}

}  // namespace filiform::test
