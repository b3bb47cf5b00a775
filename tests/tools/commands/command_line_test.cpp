// Random command lines: each ends with a documented exit code and prints no control characters and no internal error.
#include "tests/support/campaign.h"
#include "tests/support/run_here.h"
#include "tests/support/sanitized.h"
#include "tests/support/temp_folder.h"

#include <filesystem>
#include <random>
#include <string>
#include <vector>

#include <gtest/gtest.h>

namespace filiform {
namespace {

namespace fs = std::filesystem;

// Runs the program within this process, in its own folder.
class CommandLine : public ::testing::Test {
 protected:
  CommandLine() {
    fs::current_path(folder_.path());
    test::writeBytes("cell.swc", "1 1 0 0 0 5 -1\n2 3 10 0 0 1 1\n3 3 20 0 0 1 2\n4 3 30 5 0 1 3\n");
    test::writeBytes("evil\x1b[31m\xe2\x80\xae.swc", "1 1 0 0 0 1 -1\nx\x1b]0;y\x07 z\n");
    test::writeBytes("table.tsv",
                     "source\tx_um\ty_um\tz_um\tqw\tqx\tqy\tqz\tname\ncell.swc\t1\t0\t0\t1\t0\t0\t0\tn\x1b[2J\n");
    run({"ingest", "cell.swc", "-o", "set.fil"});
  }
  ~CommandLine() override { fs::current_path(before_); }

  int run(const std::vector<std::string>& words) {
    const test::Outcome outcome = test::runHere(words);
    said_ = outcome.out + outcome.err;
    return outcome.exit_code;
  }

  fs::path before_ = fs::current_path();
  test::TempFolder folder_;
  std::string said_;
};

bool steersATerminal(const std::string& text) {
  for (const char c : text)
    if ((static_cast<unsigned char>(c) < 0x20 && c != '\n' && c != '\t') || c == 0x7F) return true;
  return text.find("\xe2\x80\xae") != std::string::npos;
}

TEST_F(CommandLine, AnyWordsGiveADocumentedCode) {
  struct Command {
    std::vector<std::string> good;     // a correct command line
    std::vector<std::string> options;  // options that may be added
  };
  const std::vector<Command> commands{
      {{"check", "cell.swc"}, {"--tsv", "--json", "--report", "--strict", "--profile", "--unit", "--help"}},
      {{"fix", "cell.swc", "-o", "fixed"},
       {"--force", "--drop-long-links", "--join-gaps", "--soma-links", "--unknown-radius", "--report", "--unit"}},
      {{"ingest", "cell.swc", "-o", "new.fil"},
       {"--force", "--add", "--remove", "--strict", "--levels", "--no-levels", "--capacity", "--quantum", "--unit",
        "--memory", "--threads", "--report", "--placements", "--apply-offset"}},
      {{"compact", "set.fil"}, {"--memory", "--threads"}},
      {{"info", "set.fil"}, {"--json", "--parameters", "--cell"}},
      {{"cells", "set.fil"}, {"--name", "--length", "--json", "--tsv"}},
      {{"verify", "set.fil"}, {"--deep"}},
      {{"nearest", "set.fil", "1", "2", "3"},
       {"--k", "--radius", "--approximate", "--epsilon", "--points", "--engine", "--budget", "--box", "--ray",
        "--tolerance", "--slope", "--threads", "--json", "--tsv"}},
      {{"path", "set.fil", "cell:1", "cell:2"}, {"--to-farthest-tip", "--output", "--json", "--tsv"}},
      {{"export", "set.fil", "--cell", "cell", "-o", "out.swc"}, {"--force"}},
      {{"synth", "new.zip", "--cells", "1"}, {"--kind"}},
      {{"", "set.fil"}, {"--version"}}};
  const std::vector<std::string> values{"cell.swc",
                                        "evil\x1b[31m\xe2\x80\xae.swc",
                                        "table.tsv",
                                        "set.fil",
                                        "new.fil",
                                        "cell",
                                        "cell:2+0.5",
                                        "nobody\x1b[31m",
                                        ".",
                                        "",
                                        "-",
                                        "0",
                                        "1",
                                        "-1",
                                        "7",
                                        "2^-9",
                                        "2^1e9",
                                        "2^nan",
                                        "1e999",
                                        "-1e-320",
                                        "nan",
                                        "inf",
                                        "18446744073709551616",
                                        "4294967295",
                                        "64MiB",
                                        "9e18",
                                        "99999999999GiB",
                                        "-5 KiB",
                                        "um",
                                        "4,4,40",
                                        "1,,1",
                                        "0x10",
                                        "1e3,2",
                                        "packed",
                                        "cgal",
                                        "tree"};
  std::mt19937_64 random(88);
  const auto any = [&](const std::vector<std::string>& list) { return list[random() % list.size()]; };
  const int times = test::wholeCampaign() ? 50000 : test::kSanitized ? 100 : 400;
  int codes[4] = {};
  for (int i = 0; i < times; ++i) {
    const Command& command = commands[random() % commands.size()];
    std::vector<std::string> words = command.good;
    for (std::size_t w = 1; w < words.size(); ++w)
      if (random() % 8 == 0 && words[0] != "synth") words[w] = any(values);
    for (std::size_t n = random() % 4; n > 0; --n) {
      words.push_back(any(command.options));
      if (random() % 3 != 0) words.push_back(any(values));
      if (random() % 16 == 0 && !words.back().empty())
        words.back()[random() % words.back().size()] = static_cast<char>("\x01\xff%9e-\t"[random() % 7]);
    }
    std::string line;
    for (const std::string& word : words) line += "'" + word + "' ";
    SCOPED_TRACE(line);
    const int code = run(words);
    ASSERT_TRUE(code >= 0 && code <= 3) << code << said_;
    ++codes[code];
    EXPECT_EQ(said_.find("internal error"), std::string::npos) << said_;
    EXPECT_FALSE(steersATerminal(said_)) << said_;
    for (const char* made : {"new.fil", "new.zip", "out.swc"}) fs::remove_all(made);
    ASSERT_FALSE(HasNonfatalFailure());
  }
  EXPECT_GT(codes[0], times / 20);
  EXPECT_GT(codes[2], times / 10);
  test::tell(std::to_string(times) + " command lines made up: exit codes 0, 1, 2, 3 " + std::to_string(codes[0]) +
             ", " + std::to_string(codes[1]) + ", " + std::to_string(codes[2]) + ", " + std::to_string(codes[3]) +
             " times");
}

}  // namespace
}  // namespace filiform
