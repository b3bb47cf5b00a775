// Runs every example of every --help and of every document as a process, and checks its output. tests/README.md defines
// an example.
#include "tests/support/documented_commands.h"
#include "tests/support/folders.h"
#include "tests/support/process.h"
#include "tests/support/sanitized.h"
#include "tests/support/temp_folder.h"

#include <algorithm>
#include <chrono>
#include <cstdlib>
#include <filesystem>
#include <iostream>
#include <map>
#include <regex>
#include <set>
#include <sstream>
#include <string>
#include <utility>
#include <vector>

#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

namespace filiform {
namespace {

namespace fs = std::filesystem;
using test::DocumentedCommand;
using test::DocumentedKind;
using test::Outcome;
using test::RunnableCommand;

bool isThere(const std::string& program) {
  return std::system(("command -v " + program + " >/dev/null 2>&1").c_str()) == 0;
}

std::vector<std::string> wordsOf(const std::string& text) {
  std::istringstream in(text);
  std::vector<std::string> words;
  for (std::string word; in >> word;) words.push_back(word);
  return words;
}

// The arguments after the program's name.
std::vector<std::string> argumentsOf(const std::string& text) {
  std::vector<std::string> words = wordsOf(text);
  words.erase(words.begin(), std::find(words.begin(), words.end(), "filiform"));
  if (!words.empty()) words.erase(words.begin());
  return words;
}

// The commands that `filiform --help` lists.
std::vector<std::string> commandNames() {
  std::vector<std::string> names;
  std::istringstream help(test::runFiliform({"--help"}).out);
  std::string line;
  while (std::getline(help, line) && !line.starts_with("Subcommands:")) {
  }
  while (std::getline(help, line) && line.starts_with("  ") && line[2] != ' ')
    names.push_back(line.substr(2, line.find(' ', 2) - 2));
  return names;
}

std::string sourceFile(const std::string& path) { return test::readBytes(test::inSource(path)); }

// The documents of the project, as paths from its root.
std::vector<std::string> documents() {
  const fs::path root(test::inSource(""));
  std::vector<std::string> paths{"README.md"};
  for (const char* room : {".github", "index", "device", "solver", "viewer", "tools", "tests"})
    for (const auto& entry : fs::recursive_directory_iterator(root / room))
      if (entry.path().extension() == ".md") paths.push_back(fs::relative(entry.path(), root).string());
  std::sort(paths.begin(), paths.end());
  return paths;
}

// The files that the examples name. Made once; each document gets its own copy.
class ScratchFolder {
 public:
  ScratchFolder() {
    const std::string script = R"sh(
set -e
mkdir f && cd f
filiform synth column.zip --cells 3 --seed 1
filiform synth library.zip --cells 3 --seed 1 --placements-out column.tsv
filiform ingest column.zip -o column.fil
mkdir folder
i=0
for name in cell_00042 cell_00005 cell_00000; do
  id=$(filiform cells column.fil --tsv | sed -n "$((i + 2))p" | cut -f 2)
  filiform export column.fil --cell "$id" -o folder/$name.swc
  i=$((i + 1))
done
rm -r column.fil
filiform ingest folder -o column.fil
filiform cells column.fil --tsv | sed 's/^[^\t]*\t\([^\t]*\).*/\1,Tm3/; 1s/.*/cell,type/' > types.csv
filiform synth cell.zip --kind scene2
filiform ingest cell.zip -o cell.fil
filiform export cell.fil --cell scene2 -o cell.swc
mv cell.zip more.zip
rm -r cell.fil
mkdir more morphologies
cp cell.swc more
cp folder/*.swc morphologies
mkdir -p corpus/malformed corpus/morphologies/allen-celltypes
cp folder/*.swc corpus/morphologies/allen-celltypes
cp cell.swc corpus/malformed/awkward.swc
cp column.zip corpus/malformed/awkward.zip
for set in my allen big lev old new; do cp -r column.fil $set.fil; done
filiform ingest --remove cell_00005 -o new.fil
cp folder/cell_00042.swc first.swc
cp folder/cell_00005.swc second.swc
for zip in archive demo; do cp column.zip $zip.zip; done
cp library.zip lib.zip
cp column.tsv col.tsv
filiform synth circuit --format sonata --cells 6 --library 3
filiform ingest circuit/circuit_config.json -o circuit.fil
cp circuit/column/nodes.h5 circuit/morphologies/merged-morphologies.h5 .
mv circuit/circuit_config.json circuit/column circuit/input .
mv circuit/morphologies/merged-morphologies.h5 morphologies
rm -r circuit
printf '0 700 0\n10, 600, 5\n# a remark\n' > soma.txt
filiform navigate column.fil --seconds 0.5 --record f.rec
cp f.rec travel.rec
mkdir recorded
filiform serve column.fil --no-token --listen 127.0.0.1:0 --record-sessions recorded > address 2>/dev/null & server=$!
while [ ! -s address ]; do sleep 0.05; done
python3 "$TESTS/support/servers/short_session" "$(cat address)" column
kill $server
wait $server
for ending in rec rec.json rec.frames; do mv recorded/*.$ending session.$ending; done
rm -r recorded address
head -c 4096 /dev/zero > falcon.bin
mkdir before after
filiform bench extremes --quick --out before
cp before/bench.json after
ln -s "$TESTS" tests
)sh";
    const Outcome made = inFolder(folder_.path(), "TESTS='" + test::inSource("tests") + "'; " + script);
    EXPECT_EQ(made.exit_code, 0) << made.out << made.err;
    const Outcome drawn = inFolder(folder_ / "f", "filiform render column.fil -o try.png --size 16x16 && rm try.png");
    draws_ = drawn.exit_code == 0;
    if (!draws_) std::cout << "no picture can be drawn here: " << drawn.err;
    shows_ = draws_ && isThere("xvfb-run");
    if (!shows_) std::cout << "no window can be opened here: no xvfb-run\n";
  }
  // Runs the line in a folder. `filiform` is the program under test.
  static Outcome inFolder(const std::string& folder, const std::string& line) {
    return test::runFiliformInShell(
        "cd '" + folder + "' && PATH=\"$(dirname \"$1\"):$PATH\" && unset FILIFORM_CORPUS && " + line, {});
  }
  std::string copyFor(const std::string& document) {
    std::string name = document;
    std::replace(name.begin(), name.end(), '/', '_');
    fs::copy(folder_ / "f", folder_ / name, fs::copy_options::recursive | fs::copy_options::copy_symlinks);
    return folder_ / name;
  }
  bool draws() const { return draws_; }
  bool shows() const { return shows_; }

 private:
  test::TempFolder folder_;
  bool draws_ = false, shows_ = false;
};

bool beginsWith(const fs::path& file, const std::string& bytes) {
  return fs::is_regular_file(file) && test::readBytes(file.string()).starts_with(bytes);
}

// Checks that a file which a command wrote has the format that its name states.
::testing::AssertionResult looksRight(const fs::path& file) {
  const auto wrong = [&](const char* what) {
    return ::testing::AssertionFailure() << file.filename().string() << ": " << what;
  };
  const std::string ending = file.extension().string();
  if (ending == ".mp4" && !fs::exists(file))  // without ffmpeg there are pictures instead
    return looksRight(file.parent_path() / (file.stem().string() + "-00001.png"));
  if (!fs::exists(file)) return wrong("is not there");
  if (fs::is_directory(file)) {
    if (ending == ".fil") return fs::exists(file / "CURRENT") ? ::testing::AssertionSuccess() : wrong("is no tile set");
    return fs::is_empty(file) ? wrong("is empty") : ::testing::AssertionSuccess();
  }
  if (fs::file_size(file) == 0) return wrong("is empty");
  if (ending == ".png" && !beginsWith(file, "\x89PNG\r\n")) return wrong("is no PNG");
  if (ending == ".zip" && !beginsWith(file, "PK\x03\x04")) return wrong("is no zip");
  if (ending == ".csv" && !beginsWith(file, "tick,time_s,")) return wrong("has no header of ticks");
  if (ending == ".tsv" && !beginsWith(file, "source\t") && !beginsWith(file, "from\t") &&
      !beginsWith(file, "layer\t") && !beginsWith(file, "type\t"))
    return wrong("has no header of a placement table, contacts or a matrix of the attributes 'layer' and 'type'");
  if (ending == ".swc" && !beginsWith(file, "#")) return wrong("has no header");
  if (ending == ".json" && !nlohmann::json::accept(test::readBytes(file.string()))) return wrong("is no JSON");
  return ::testing::AssertionSuccess();
}

std::vector<std::string> outputsOf(const std::vector<std::string>& arguments) {
  static const std::set<std::string> kOptions{"-o",       "--out",    "--output",  "--csv",           "--plot",
                                              "--report", "--record", "--picture", "--placements-out"};
  std::vector<std::string> outputs;
  for (std::size_t i = 0; i + 1 < arguments.size(); ++i)
    if (kOptions.contains(arguments[i]) && arguments[i + 1] != "-") outputs.push_back(arguments[i + 1]);
  if (arguments.size() > 1 && arguments[0] == "synth") outputs.push_back(arguments[1]);
  return outputs;
}

using ByCommand = std::map<std::string, std::string>;

// The first field of --json, and the first column of --tsv.
const ByCommand kFirstFields{{"check", "verdict"},   {"info", "cells"},   {"cells", "id"},     {"nearest", "query"},
                             {"path", "cell"},       {"measure", "id"},   {"compare", "a"},    {"navigate", "outcome"},
                             {"devices", "devices"}, {"render", "width"}, {"bench", "format"}, {"replay", "set"}};
const ByCommand kFirstColumns{{"check", "file"}, {"cells", "id"},      {"measure", "id"},
                              {"compare", "a"},  {"nearest", "query"}, {"path", "sample"}};
// A part of the text output of each command.
const ByCommand kTexts{{"synth", " segments, "},
                       {"check", " accepted, "},
                       {"fix", " lists each change"},
                       {"ingest", " tiles, "},
                       {"attributes", ": cells with a row of "},
                       {"compact", " tiles, "},
                       {"info", "  segments   "},
                       {"cells", "length"},
                       {"measure", " "},
                       {"contacts", "contact site"},
                       {"compare", " um"},
                       {"verify", ": sound: "},
                       {"nearest", "query\trank"},
                       {"path", " um along the cell, "},
                       {"export", " samples of "},
                       {"navigate", "route "},
                       {"devices", "sim:medium"},
                       {"render", "drawn "},
                       {"serve", "http://127.0.0.1:"},
                       {"replay", " HAND frames: "},
                       {"evaluate", "|---|"},
                       {"bench", "|---|"}};

std::string expectedOf(const ByCommand& expected, const std::string& name) {
  const auto found = expected.find(name);
  EXPECT_NE(found, expected.end()) << "say in this file what '" << name << "' prints";
  return found == expected.end() ? "" : found->second;
}

void examine(const std::vector<std::string>& arguments, const Outcome& outcome, const std::string& folder) {
  const std::string& name = arguments.at(0);
  const auto has = [&](const char* option) {
    return std::find(arguments.begin(), arguments.end(), option) != arguments.end();
  };
  // xvfb-run removes its folder while the server may still write there, and then ends with a code of its own.
  if (outcome.exit_code == 5 && outcome.err.find("xvfb-run: error: problem while cleaning up") != std::string::npos)
    return;
  // Hardware and the page for browsers may be absent. Then one line says what is missing.
  const bool hardware = (name == "devices" && (has("--test") || has("--setup"))) ||
                        (name == "view" && (has("spacemouse") || has("falcon")));
  const bool unbuilt_page = name == "view" && has("--web") && outcome.exit_code == 2;
  if ((hardware && outcome.exit_code == 3) || unbuilt_page) {
    EXPECT_TRUE(outcome.oneLineOnStderr()) << outcome.err;
    return;
  }
  // A small run on a busy machine may miss a promise.
  const bool missed_promise = name == "bench" && has("--strict") && outcome.exit_code == 5;
  ASSERT_TRUE(outcome.exit_code == 0 || missed_promise) << outcome.exit_code << outcome.out << outcome.err;
  std::istringstream errors(outcome.err);
  for (std::string line; std::getline(errors, line);)
    EXPECT_TRUE(missed_promise || !line.starts_with("filiform: ") || line.starts_with("filiform: note: ")) << line;
  for (const std::string& output : outputsOf(arguments)) EXPECT_TRUE(looksRight(fs::path(folder) / output));
  if (name == "view") {
    EXPECT_EQ(outcome.out.starts_with("| input | does |"), has("--keys")) << outcome.out;
    return;
  }
  if (has("--json-usage")) {
    EXPECT_TRUE(nlohmann::json::accept(outcome.out)) << outcome.out;
  } else if (has("--help") || has("--version")) {
    EXPECT_NE(outcome.out.find("filiform"), std::string::npos) << outcome.out;
  } else if (has("--json")) {
    const auto json = nlohmann::ordered_json::parse(outcome.out, nullptr, false);
    ASSERT_FALSE(json.is_discarded() || json.empty()) << outcome.out;
    EXPECT_EQ((json.is_array() ? json[0] : json).begin().key(), expectedOf(kFirstFields, name));
  } else if (has("--tsv")) {
    EXPECT_EQ(outcome.out.substr(0, outcome.out.find('\t')), expectedOf(kFirstColumns, name));
  } else if (has("--simulate-haply")) {
    EXPECT_NE(outcome.out.find("--device haply:127.0.0.1:"), std::string::npos) << outcome.out;
  } else if (has("--list")) {
    EXPECT_NE(outcome.out.find("peers:"), std::string::npos) << outcome.out;
  } else {
    EXPECT_NE(outcome.out.find(expectedOf(kTexts, name)), std::string::npos) << outcome.out;
  }
}

struct Tally {
  std::size_t documents = 0, found = 0, run = 0, shortened = 0, again = 0, mentions = 0;
  std::vector<std::string> skipped;

  void print(const char* what) const {
    std::cout << what << ": " << documents << " with commands; " << found << " commands: " << run + shortened
              << " run (" << shortened << " of them in a short form), " << again << " workloads run before, "
              << mentions << " names of commands alone, " << skipped.size() << " not run:\n";
    for (const std::string& one : skipped) std::cout << "  " << one << '\n';
  }
};

class Documents : public ::testing::Test {
 protected:
  void SetUp() override {
    if (test::kSanitized) GTEST_SKIP() << "processes of the program, once is enough: the preset dev runs them";
  }

  // Runs the commands of one document, in their order, in a folder for this document.
  void run(ScratchFolder& scratch, const std::vector<DocumentedCommand>& commands, Tally& tally) {
    if (commands.empty()) return;
    ++tally.documents;
    const std::string folder = scratch.copyFor(commands.front().document);
    for (const DocumentedCommand& command : commands) {
      ++tally.found;
      const std::string where = command.document + ":" + std::to_string(command.line) + ": " + command.text;
      SCOPED_TRACE(where);
      const std::vector<std::string> words = argumentsOf(command.text);
      const std::string name = words.empty() ? "" : words[0];
      if (command.kind == DocumentedKind::mention) {
        ++tally.mentions;
        EXPECT_TRUE(name.empty() || std::count(names_.begin(), names_.end(), name) == 1) << "no such command";
        continue;
      }
      const bool unfit = (name == "render" && !scratch.draws()) || (name == "view" && !scratch.shows()) ||
                         (command.text.starts_with("umockdev-run") && !isThere("umockdev-run"));
      if (command.kind != DocumentedKind::example || unfit) {
        tally.skipped.push_back(where + (unfit                                      ? " (what it needs is not here)"
                                         : command.kind == DocumentedKind::synopsis ? " (synopsis)"
                                                                                    : " (the document says so)"));
        continue;
      }
      const RunnableCommand line = test::runnable(command.text);
      if ((name == "bench" || name == "evaluate") && line.shortened && !done_.insert(line.text).second) {
        ++tally.again;
        continue;
      }
      ++(line.shortened ? tally.shortened : tally.run);
      const std::vector<std::string> arguments = argumentsOf(line.text);
      const bool grows = std::any_of(arguments.begin(), arguments.end(),
                                     [](const std::string& word) { return word == "--add" || word == "--remove"; });
      for (const std::string& output : outputsOf(arguments))
        if (!grows) fs::remove_all(fs::path(folder) / output);
      const auto started = std::chrono::steady_clock::now();
      const Outcome outcome = ScratchFolder::inFolder(folder, line.text);
      const double s = std::chrono::duration<double>(std::chrono::steady_clock::now() - started).count();
      if (s > 3) std::cout << "slow, " << s << " s: " << line.text << '\n';
      SCOPED_TRACE("run as: " + line.text);
      ASSERT_NO_FATAL_FAILURE(examine(arguments, outcome, folder));
    }
  }

  std::vector<std::string> names_ = commandNames();
  std::set<std::string> done_;
};

TEST_F(Documents, EveryExampleOfTheHelpRuns) {
  ASSERT_GE(names_.size(), 13u);
  ScratchFolder scratch;
  ASSERT_FALSE(HasFailure());
  Tally tally;
  run(scratch, test::commandsOfHelp("filiform --help", test::runFiliform({"--help"}).out), tally);
  for (const std::string& name : names_) {
    const std::vector<DocumentedCommand> commands =
        test::commandsOfHelp("filiform " + name + " --help", test::runFiliform({name, "--help"}).out);
    EXPECT_FALSE(commands.empty()) << name << " --help has no example";
    run(scratch, commands, tally);
  }
  tally.print("help texts");
}

TEST_F(Documents, EveryExampleOfTheDocumentsRuns) {
  ScratchFolder scratch;
  ASSERT_FALSE(HasFailure());
  Tally tally;
  for (const std::string& path : documents()) run(scratch, test::commandsOfMarkdown(path, sourceFile(path)), tally);
  EXPECT_GT(tally.run + tally.shortened, 50u);
  tally.print("documents");
}

// A code span that begins with an option names an option of the program or of a script.
TEST_F(Documents, EveryOptionNamedIsThere) {
  std::string helps = test::runFiliform({"--help"}).out;
  for (const std::string& name : names_) helps += test::runFiliform({name, "--help"}).out;
  for (const char* other : {"tools/setup", "tools/test", "tools/demo", "tools/fuzz", "tools/mpi/together.cpp"})
    helps += sourceFile(other);
  std::size_t options = 0;
  for (const std::string& path : documents()) {
    for (const DocumentedCommand& option : test::optionsOfMarkdown(path, sourceFile(path))) {
      ++options;
      const std::size_t at = helps.find(option.text);
      EXPECT_NE(at, std::string::npos) << path << ":" << option.line << ": " << option.text << " is no option";
    }
  }
  EXPECT_GT(options, 20u);
}

// A link, or a code span with the path of a source, names an existing file or folder. Paths with a word in capitals are
// patterns.
TEST_F(Documents, EveryPathNamedIsThere) {
  static const std::regex kPath(
      R"((?:`((?:index|device|solver|viewer|tools|tests|\.github)/[\w./]+|[a-z_]\w*(?:/\w+)*/\w+\.(?:h|cpp|py|md|json))`)|(?:\]\(([^)#:]+)(?:#[^)]*)?\)))");
  static const std::regex kPattern("(^|/)[A-Z]+/");
  const fs::path root(test::inSource(""));
  std::size_t paths = 0;
  for (const std::string& document : documents()) {
    const fs::path folder = fs::path(document).parent_path();
    std::istringstream text(sourceFile(document));
    std::string line;
    for (std::size_t number = 1; std::getline(text, line); ++number) {
      std::vector<fs::path> bases{root, root / folder};  // and the folders of a line's links
      for (std::sregex_iterator i(line.begin(), line.end(), kPath), end; i != end; ++i) {
        const std::string path = (*i)[1].matched ? (*i)[1].str() : (*i)[2].str();
        if (std::regex_search(path, kPattern)) continue;
        if ((*i)[2].matched) bases.push_back((root / folder / path).parent_path());
        ++paths;
        const bool is_there =
            std::any_of(bases.begin(), bases.end(), [&](const fs::path& base) { return fs::exists(base / path); });
        EXPECT_TRUE(is_there) << document << ":" << number << ": " << path << " does not exist";
      }
    }
  }
  EXPECT_GT(paths, 50u);
}

TEST(DocumentedCommands, AreFoundInMarkdown) {
  const std::string text =
      "Run `filiform info my.fil`, or `filiform view`; not `filiformx a` or `a filiform b`.\n"
      "```\nfiliform nearest my.fil 1 2 3   # the nearest\nls\nfiliform ingest a.zip -o b.fil; filiform info "
      "b.fil\n```\n"
      "| `X=1 xvfb-run -a filiform view SET` | `filiform render a \\| b` | `filiform COMMAND --help` |\n"
      "`filiform devices --test falcon` (no test runs this)\n"
      "`filiform ingest a.zip -o b.fil --memory 1GiB`\n";
  std::vector<std::pair<std::size_t, std::string>> examples;
  std::map<DocumentedKind, int> kinds;
  for (const DocumentedCommand& command : test::commandsOfMarkdown("a.md", text)) {
    ++kinds[command.kind];
    if (command.kind == DocumentedKind::example) examples.emplace_back(command.line, command.text);
  }
  const std::vector<std::pair<std::size_t, std::string>> expected{{1, "filiform info my.fil"},
                                                                  {3, "filiform nearest my.fil 1 2 3"},
                                                                  {5, "filiform ingest a.zip -o b.fil"},
                                                                  {5, "filiform info b.fil"},
                                                                  {7, "X=1 xvfb-run -a filiform view SET"},
                                                                  {9, "filiform ingest a.zip -o b.fil --memory 1GiB"}};
  EXPECT_EQ(examples, expected);
  EXPECT_EQ(kinds[DocumentedKind::mention], 1);
  EXPECT_EQ(kinds[DocumentedKind::synopsis], 2);
  EXPECT_EQ(kinds[DocumentedKind::not_run], 1);
}

TEST(DocumentedCommands, AreShortenedWhereTheyTakeLong) {
  const auto run_as = [](const std::string& text) { return test::runnable(text).text; };
  EXPECT_EQ(run_as("filiform info my.fil"), "filiform info my.fil");
  EXPECT_FALSE(test::runnable("filiform nearest SET --points FILE").shortened) << "stand-ins alone";
  EXPECT_EQ(run_as("filiform synth lib.zip --cells 31000 --seed 1"), "filiform synth lib.zip --cells 3 --seed 1");
  EXPECT_EQ(run_as("filiform synth lib.zip --cells 2"), "filiform synth lib.zip --cells 2");
  EXPECT_EQ(run_as("filiform navigate big.fil --seconds 600 --realtime"),
            "filiform navigate big.fil --seconds 0.5 --realtime");
  EXPECT_EQ(run_as("filiform navigate big.fil"), "filiform navigate big.fil --seconds 0.5");
  EXPECT_EQ(run_as("FILIFORM_CORPUS=CORPUS filiform bench --out out"),
            "FILIFORM_CORPUS=corpus filiform bench extremes --out out --quick");
  EXPECT_EQ(run_as("filiform bench nearest --size 10000000 --long --corpus DIR"),
            "filiform bench nearest --corpus corpus/morphologies --quick");
  EXPECT_EQ(run_as("filiform bench --list"), "filiform bench --list");
  EXPECT_EQ(run_as("filiform view SET"), "xvfb-run -a filiform view column.fil --seconds 0.3");
  EXPECT_EQ(run_as("filiform view --keys"), "filiform view --keys");
}

}  // namespace
}  // namespace filiform
