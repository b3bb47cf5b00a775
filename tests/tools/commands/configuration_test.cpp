// Options from the environment and from --config, --json-usage and --progress json, as processes.
#include "tests/support/process.h"
#include "tests/support/temp_folder.h"

#include <algorithm>
#include <cstdlib>
#include <filesystem>
#include <set>
#include <sstream>
#include <string>
#include <vector>

#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

namespace filiform {
namespace {

using test::Outcome;
using test::runFiliform;
using test::runFiliformInShell;

class Configuration : public ::testing::Test {
 protected:
  void SetUp() override { test::writeBytes(folder_ / "cell.swc", "1 1 0 0 0 5 -1\n2 3 10 0 0 1 1\n3 3 20 0 0 1 2\n"); }
  void config(const std::string& text) const { test::writeBytes(folder_ / "f.toml", text); }
  // Runs a shell line in the folder; "$1" is the program.
  Outcome shell(const std::string& line) const {
    return runFiliformInShell("cd '" + folder_.path() + "' && " + line, {});
  }
  void expectRefusal(const Outcome& outcome, int code, const std::string& says) const {
    EXPECT_EQ(outcome.exit_code, code) << outcome.err;
    EXPECT_TRUE(outcome.oneLineOnStderr()) << outcome.err;
    EXPECT_NE(outcome.err.find(says), std::string::npos) << outcome.err;
  }
  std::int64_t capacityOf(const std::string& set) const {
    return nlohmann::json::parse(shell("\"$1\" info " + set + " --json").out).at("capacity").get<std::int64_t>();
  }
  test::TempFolder folder_;
};

TEST_F(Configuration, FileGivesOptionsOfItsCommand) {
  config("# a remark\n[ingest]\ncapacity = 8\nmemory = \"256MiB\"\nno-levels = true\n\n[navigate]\nseconds = 0.1\n");
  EXPECT_EQ(shell("\"$1\" --config f.toml ingest cell.swc -o a.fil").exit_code, 0);
  EXPECT_EQ(capacityOf("a.fil"), 8);
  const Outcome after = shell("\"$1\" ingest cell.swc -o b.fil --config f.toml");
  EXPECT_EQ(after.exit_code, 0) << after.err;
  EXPECT_EQ(capacityOf("b.fil"), 8);
  const Outcome other = shell("\"$1\" --config f.toml info a.fil");
  EXPECT_EQ(other.exit_code, 0) << other.err;
}

TEST_F(Configuration, FileMayGiveRequiredOptionsAndInputs) {
  config("[ingest]\noutput = \"c.fil\"\n");
  const Outcome made = shell("\"$1\" --config f.toml ingest cell.swc");
  EXPECT_EQ(made.exit_code, 0) << made.err;
  EXPECT_TRUE(std::filesystem::exists(folder_ / "c.fil"));
}

TEST_F(Configuration, CommandLineWinsThenEnvironmentThenFile) {
  config("[ingest]\ncapacity = 8\nmemory = \"1KiB\"\n");
  EXPECT_EQ(shell("\"$1\" --config f.toml ingest cell.swc -o a.fil --capacity 16 --memory 128MiB").exit_code, 0);
  EXPECT_EQ(capacityOf("a.fil"), 16);
  expectRefusal(shell("\"$1\" --config f.toml ingest cell.swc -o b.fil"), 2, "--memory 1KiB");
  expectRefusal(shell("FILIFORM_MEMORY= \"$1\" --config f.toml ingest cell.swc -o b.fil"), 2, "--memory 1KiB");
  const Outcome made = shell("FILIFORM_MEMORY=128MiB \"$1\" --config f.toml ingest cell.swc -o b.fil");
  EXPECT_EQ(made.exit_code, 0) << made.err;
  expectRefusal(shell("FILIFORM_MEMORY=2KiB \"$1\" ingest cell.swc -o c.fil"), 2, "2KiB");
  EXPECT_EQ(shell("FILIFORM_MEMORY=2KiB \"$1\" ingest cell.swc -o c.fil --memory 128MiB").exit_code, 0);
}

TEST_F(Configuration, WrongFilesAreRefusedWithAReason) {
  expectRefusal(shell("\"$1\" --config nowhere.toml info a.fil"), 3, "nowhere.toml");
  config("[ingst]\ncapacity = 8\n");
  expectRefusal(shell("\"$1\" --config f.toml ingest cell.swc -o a.fil"), 2, "--config f.toml: [ingst]");
  config("[ingest]\ncapcity = 8\n");
  expectRefusal(shell("\"$1\" --config f.toml ingest cell.swc -o a.fil"), 2, "did you mean 'capacity'");
  config("capacity = 8\n");
  expectRefusal(shell("\"$1\" --config f.toml ingest cell.swc -o a.fil"), 2, "[ingest]");
  config("[ingest]\ncapacity = \"many\"\n");
  expectRefusal(shell("\"$1\" --config f.toml ingest cell.swc -o a.fil"), 2, "(from f.toml)");
  EXPECT_FALSE(std::filesystem::exists(folder_ / "a.fil"));
}

TEST_F(Configuration, WrongVariableIsNamed) {
  expectRefusal(shell("FILIFORM_THREADS=two \"$1\" ingest cell.swc -o a.fil"), 2, "FILIFORM_THREADS");
  EXPECT_EQ(shell("FILIFORM_THREADS=1 \"$1\" ingest cell.swc -o a.fil").exit_code, 0);
  EXPECT_EQ(shell("FILIFORM_THREADS= \"$1\" ingest cell.swc -o b.fil").exit_code, 0) << "empty is not given";
}

TEST_F(Configuration, CacheFolderComesFromTheEnvironment) {
  // A file where the folder should be: the variable is read.
  expectRefusal(shell("FILIFORM_CACHE=cell.swc \"$1\" info http://127.0.0.1:1/v1/sets/x"), 3, "cell.swc");
}

std::set<std::string> optionsOf(const nlohmann::json& command) {
  std::set<std::string> names;
  for (const nlohmann::json& option : command.at("options"))
    for (const nlohmann::json& name : option.at("names")) names.insert(name.get<std::string>());
  return names;
}

TEST_F(Configuration, JsonUsageDescribesEveryCommandAndOption) {
  const Outcome told = runFiliform({"--json-usage"});
  ASSERT_EQ(told.exit_code, 0) << told.err;
  const nlohmann::json usage = nlohmann::json::parse(told.out);
  EXPECT_EQ(usage.at("program"), "filiform");
  ASSERT_GE(usage.at("commands").size(), 17u);
  EXPECT_TRUE(optionsOf(usage).contains("--json-usage"));
  for (const nlohmann::json& command : usage.at("commands")) {
    const auto name = command.at("name").get<std::string>();
    SCOPED_TRACE(name);
    EXPECT_FALSE(command.at("description").get<std::string>().empty());
    if (command.value("program", "") == "filiform-lab" && command.at("options").size() < 2) continue;  // not built here
    EXPECT_FALSE(command.at("examples").empty());
    // Every option that the help lists, and no other.
    std::istringstream help(runFiliform({name, "--help"}).out);
    std::set<std::string> listed;
    for (std::string line; std::getline(help, line);) {
      if (!line.starts_with("  -")) continue;
      std::istringstream words(line.substr(2, line.find("  ", 2) - 2));
      for (std::string word; std::getline(words, word, ',');)
        if (word.starts_with("-")) listed.insert(word.substr(0, word.find(' ')));
    }
    EXPECT_EQ(optionsOf(command), listed);
    for (const nlohmann::json& option : command.at("options"))
      EXPECT_FALSE(option.at("description").get<std::string>().empty());
  }
  const auto ingest = std::find_if(usage["commands"].begin(), usage["commands"].end(),
                                   [](const nlohmann::json& command) { return command["name"] == "ingest"; });
  for (const nlohmann::json& option : ingest->at("options")) {
    if (option["names"][0] != "--threads") continue;
    EXPECT_EQ(option["environment"], "FILIFORM_THREADS");
    EXPECT_EQ(option["default"], "0");
    EXPECT_FALSE(option["required"].get<bool>());
  }
  expectRefusal(runFiliform({"--json-usage", "ingest"}), 2, "");
}

TEST_F(Configuration, ProgressAsJsonLines) {
  const Outcome made = shell("\"$1\" ingest cell.swc -o a.fil --progress json");
  ASSERT_EQ(made.exit_code, 0) << made.err;
  std::istringstream lines(made.err);
  std::set<std::string> steps;
  for (std::string line; std::getline(lines, line);) {
    const nlohmann::json step = nlohmann::json::parse(line, nullptr, false);
    ASSERT_FALSE(step.is_discarded()) << line;
    steps.insert(step.at("progress").get<std::string>());
    EXPECT_GE(step.at("elapsed_s").get<double>(), 0);
    EXPECT_TRUE(step.at("left_s").is_null() || step["left_s"].get<double>() >= 0) << line;
    EXPECT_TRUE(step.at("total").is_null() || step["done"] <= step["total"]) << line;
    EXPECT_TRUE(step.at("unit").is_string());
  }
  EXPECT_TRUE(steps.contains("reading"));
  EXPECT_GE(steps.size(), 2u);
  EXPECT_EQ(made.out.find('{'), std::string::npos) << "progress goes to standard error";
  EXPECT_EQ(shell("\"$1\" verify a.fil --progress none").err, "");
  expectRefusal(shell("\"$1\" verify a.fil --progress bar"), 2, "--progress");
}

}  // namespace
}  // namespace filiform
