#include "tools/lab/bench/bench.h"

#include "index/errors.h"
#include "tests/support/folders.h"
#include "tests/support/process.h"
#include "tests/support/sanitized.h"
#include "tests/support/temp_folder.h"
#include "tools/lab/bench/bench_record.h"
#include "tools/lab/bench/workloads.h"
#include "tools/pictures/canvas.h"
#include "tools/pictures/png.h"

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <limits>
#include <random>
#include <set>
#include <sstream>
#include <stdexcept>
#include <string>
#include <vector>

#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

namespace filiform::tools {
namespace {

std::string fileText(const std::string& path) {
  std::ifstream file(path, std::ios::binary);
  std::ostringstream text;
  text << file.rdbuf();
  return text.str();
}

constexpr double kNoFigure = std::numeric_limits<double>::quiet_NaN();

BenchReport small() {
  BenchReport report;
  report.tables.push_back(
      {"times", "Times in us", {"what", "mean", "count"}, {{std::string("one"), 1.25, std::int64_t{3}}}});
  report.goals.push_back({"fast", "<= 2", "<= 1", 1.25, true, false});
  report.notes.push_back("a note");
  report.versions.emplace_back("Peer", "1.2");
  report.pictures.push_back("one.png");
  report.bounds.push_back({"rounded", "at most half a step", 0.5, 0.25, "um"});
  report.samples.push_back({"times", {"one"}, "mean", "ns", false, {3, 1, 2}});
  Plot plot;
  plot.title = "Time against error";
  plot.x_label = "error (um)";
  plot.y_label = "time (ns)";
  plot.series = {{"one & two", {1, 2, 3}, {9, 4, kNoFigure}}};
  plot.lines = {{2, "default"}};
  report.curves.push_back({"trade", plot, "the default stays"});
  return report;
}

// The problems that Debian's JSON Schema library finds in a file; empty: none.
std::string schemaProblems(const std::string& path) {
  const std::string schema = test::inSource("tools/lab/bench/bench.schema.json");
  const test::Outcome outcome = test::runFiliformInShell(
      "/usr/bin/python3 -c '\n"
      "import json, sys\n"
      "from jsonschema import Draft202012Validator as V\n"
      "schema = json.load(open(sys.argv[1]))\n"
      "V.check_schema(schema)\n"
      "for e in V(schema).iter_errors(json.load(open(sys.argv[2]))): print(e.message)\n' \"$2\" \"$3\"",
      {schema, path});
  EXPECT_EQ(outcome.exit_code, 0) << outcome.err;
  return outcome.out;
}

TEST(BenchPercentile, IsTheNearestRank) {
  EXPECT_TRUE(std::isnan(percentile({}, 0.5)));
  EXPECT_EQ(percentile({7}, 0), 7);
  EXPECT_EQ(percentile({7}, 1), 7);
  EXPECT_EQ(percentile({3, 1, 2}, 0.5), 2);
  EXPECT_EQ(percentile({4, 3, 2, 1}, 0.5), 2);
  std::mt19937_64 random(3);
  for (int round = 0; round < 200; ++round) {
    std::vector<double> values(1 + random() % 50);
    for (double& value : values) value = static_cast<double>(random() % 20);
    const double fraction = static_cast<double>(random() % 101) / 100;
    const double answer = percentile(values, fraction);
    // The smallest value such that at least this fraction of all values do not exceed it.
    const auto below = [&](double x) {
      return static_cast<double>(std::count_if(values.begin(), values.end(), [&](double v) { return v <= x; })) /
             static_cast<double>(values.size());
    };
    EXPECT_GE(below(answer) + 1e-12, fraction);
    for (const double value : values) {
      if (value < answer) {
        EXPECT_LT(below(value), fraction + 1e-12);
      }
    }
  }
}

TEST(BenchChild, HasAPeakOfItsOwnAndSendsItsNumbersBack) {
  constexpr std::size_t kBytes = 96u << 20;
  std::vector<char> ours(64u << 20, 1);  // memory of the parent, which must not count for the child
  const ChildCost little = measureInChild([] { return std::vector<double>{1.5, -2}; });
  const ChildCost much = measureInChild([] {
    std::vector<char> memory(kBytes);
    std::fill(memory.begin(), memory.end(), static_cast<char>(memory.size() & 127));
    return std::vector<double>{static_cast<double>(memory[kBytes / 2])};
  });
  EXPECT_EQ(little.numbers, (std::vector<double>{1.5, -2}));
  EXPECT_EQ(much.numbers.size(), 1u);
  EXPECT_GE(much.peak_bytes, little.peak_bytes + kBytes / 2);
  EXPECT_GE(much.wall_s, 0);
  EXPECT_EQ(ours[5], 1);
}

TEST(BenchChild, PassesOnItsMessageAndItsDeath) {
  try {
    measureInChild([]() -> std::vector<double> { throw std::runtime_error("the disk is full"); });
    FAIL() << "nothing was thrown";
  } catch (const std::runtime_error& error) {
    EXPECT_EQ(std::string(error.what()), "the disk is full");
  }
  EXPECT_THROW(measureInChild([]() -> std::vector<double> { _exit(3); }), std::runtime_error);
}

TEST(BenchWorkload, WritesWhatItMeasuredAsJsonAndMarkdown) {
  const test::TempFolder folder;
  BenchOptions options;
  options.out = folder.path();
  options.seed = 7;
  options.quick = true;
  options.progress = [](const std::string&) {};
  const Workload workload{"small", "a small one", [](const BenchOptions&) { return small(); }};
  const BenchResult result = runWorkload(workload, options);
  const std::string markdown = workloadMarkdown(result, options);
  const auto json = nlohmann::json::parse(fileText(folder.path() + "/small.json"));
  EXPECT_EQ(json.at("workload"), "small");
  EXPECT_EQ(json.at("seed"), 7);
  EXPECT_EQ(json.at("quick"), true);
  EXPECT_TRUE(json.at("machine").contains("processor"));
  EXPECT_EQ(json.at("versions").at("Peer"), "1.2");
  EXPECT_EQ(json.at("goals").at(0).at("measured"), 1.25);
  EXPECT_EQ(json.at("goals").at(0).at("met_must"), true);
  EXPECT_EQ(json.at("tables").at("times").at("rows").at(0).at("what"), "one");
  EXPECT_EQ(json.at("tables").at("times").at("rows").at(0).at("count"), 3);
  EXPECT_EQ(json.at("notes").at(0), "a note");
  EXPECT_EQ(json.at("pictures").at(0), "one.png");
  EXPECT_EQ(json.at("bounds").at(0).at("holds"), true);
  EXPECT_EQ(json.at("samples").at(0).at("batches").at(2), 2);
  EXPECT_EQ(json.at("samples").at(0).at("name"), "times: one: mean");
  EXPECT_EQ(json.at("samples").at(0).at("row"), nlohmann::json({"one"}));
  EXPECT_EQ(json.at("tables").at("times").at("keys"), nlohmann::json({"what"}));
  EXPECT_EQ(json.at("curves").at("trade").at("marks").at(0).at("label"), "default");
  EXPECT_TRUE(json.at("curves").at("trade").at("series").at(0).at("y").at(2).is_null());
  for (const char* part : {"a small one", "--seed 7 --quick", "these figures mean nothing", "Peer 1.2",
                           "| one | 1.25 | 3 |", "(one.png)", "- a note"})
    EXPECT_NE(markdown.find(part), std::string::npos) << part;
  EXPECT_EQ(fileText(folder.path() + "/small.md"), markdown);
}

TEST(BenchWorkload, RefusesTablesThatAreWrongAndFoldersThatAreNone) {
  const test::TempFolder folder;
  BenchOptions options;
  options.out = folder.path();
  options.progress = [](const std::string&) {};
  Workload workload{"odd", "", [](const BenchOptions&) {
                      BenchReport report = small();
                      report.tables[0].rows[0].pop_back();
                      return report;
                    }};
  EXPECT_THROW(runWorkload(workload, options), std::logic_error);
  workload.run = [](const BenchOptions&) {
    BenchReport report = small();
    report.tables[0].keys = {"none"};
    return report;
  };
  EXPECT_THROW(runWorkload(workload, options), std::logic_error);
  workload.run = [](const BenchOptions&) {
    BenchReport report = small();
    report.tables.push_back(report.tables[0]);
    return report;
  };
  EXPECT_THROW(runWorkload(workload, options), std::logic_error);
  workload.run = [](const BenchOptions&) { return small(); };
  options.out = folder.path() + "/none";
  EXPECT_THROW(runWorkload(workload, options), IoError);
}

TEST(BenchWorkload, NamesAreWordsAndDiffer) {
  std::set<std::string> names;
  for (const Workload& workload : workloads()) {
    EXPECT_TRUE(names.insert(workload.name).second) << workload.name;
    EXPECT_FALSE(workload.summary.empty());
    for (const char c : workload.name) EXPECT_TRUE((c >= 'a' && c <= 'z') || c == '_' || c == '-') << workload.name;
  }
  EXPECT_FALSE(names.empty());
}

TEST(BenchProgram, EveryWorkloadRunsQuickAndTheRunIsAsTheSchemaSays) {
  const test::TempFolder folder;
  std::vector<Workload> run = workloads();
  std::vector<std::string> arguments{"bench", "--quick", "--out", folder.path()};
  if (test::kSanitized) {  // without those that take most of the time: their parts have tests
    std::erase_if(run, [](const Workload& workload) {
      return workload.name == "scene" || workload.name == "streaming" || workload.name == "viewer" ||
             workload.name == "motion";
    });
    for (const Workload& workload : run) arguments.push_back(workload.name);
  }
  // The OpenGL driver leaks (see tests/CMakeLists.txt).
  const test::Outcome outcome =
      test::runFiliformInShell("ASAN_OPTIONS=detect_leaks=0:strict_string_checks=1 exec \"$@\"", arguments);
  ASSERT_EQ(outcome.exit_code, 0) << outcome.err;
  EXPECT_TRUE(outcome.err.empty()) << outcome.err;
  for (const Workload& workload : run) {
    SCOPED_TRACE(workload.name);
    const auto json = nlohmann::json::parse(test::readBytes(folder / (workload.name + ".json")));
    EXPECT_EQ(json.at("workload"), workload.name);
    EXPECT_EQ(json.at("quick"), true);
    EXPECT_FALSE(json.at("tables").empty());
    for (const auto& [name, table] : json.at("tables").items()) {
      EXPECT_FALSE(table.at("rows").empty()) << name;
      std::set<std::string> rows;  // each row is identified by its keys
      for (const auto& row : table.at("rows")) {
        std::string keys;
        for (const auto& key : table.at("keys")) keys += row.at(key.get<std::string>()).dump() + ' ';
        EXPECT_TRUE(rows.insert(keys).second) << name << ": " << keys;
      }
    }
    for (const auto& picture : json.at("pictures"))
      EXPECT_EQ(test::readBytes(folder / picture.get<std::string>()).substr(1, 3), "PNG");
    EXPECT_NE(outcome.out.find(test::readBytes(folder / (workload.name + ".md"))), std::string::npos);
    EXPECT_FALSE(json.contains("bounds") && json.at("bounds").empty());
    if (workload.name == "ingest")
      for (const auto& row : json.at("tables").at("cost").at("rows")) {
        EXPECT_EQ(row.at("runs"), ingestRuns(1, true));
        EXPECT_LE(row.at("cpu_least"), row.at("cpu_s_per_million"));
        EXPECT_LE(row.at("cpu_s_per_million"), row.at("cpu_most"));
      }
  }
  EXPECT_EQ(schemaProblems(folder / "bench.json"), "");
  const std::string page = test::readBytes(folder / "bench.html");
  EXPECT_EQ(page.find("<script"), std::string::npos);
  EXPECT_EQ(page.find("src=\"http"), std::string::npos);
  EXPECT_NE(page.find("src=\"data:image/svg+xml;base64,"), std::string::npos);
  EXPECT_EQ(page.find("alt=\"\""), std::string::npos);
}

TEST(BenchSchema, RefusesWhatIsNoRun) {
  const test::TempFolder folder;
  BenchOptions options;
  options.out = folder.path();
  writePng(whitePicture(4, 4), folder.file("one.png"));
  writeBenchRun({{"small", "a small one", 1.5, small()}}, options, 2, 0.5);
  const std::string path = folder.file("bench.json");
  EXPECT_EQ(schemaProblems(path), "");
  for (const char* missing : {"seed", "machine", "workloads"}) {
    auto json = nlohmann::json::parse(fileText(path));
    json.erase(missing);
    writeText(folder.file("bad.json"), json.dump());
    EXPECT_NE(schemaProblems(folder.file("bad.json")).find(missing), std::string::npos);
  }
  auto json = nlohmann::json::parse(fileText(path));
  json["workloads"][0]["curves"]["trade"]["series"][0]["y"][0] = "much";
  writeText(folder.file("bad.json"), json.dump());
  EXPECT_NE(schemaProblems(folder.file("bad.json")), "");
}

TEST(BenchRun, WritesPageAndTableOfEverything) {
  const test::TempFolder folder;
  BenchOptions options;
  options.out = folder.path();
  writePng(whitePicture(4, 4), folder.file("one.png"));
  writeBenchRun({{"small", "a small one", 1.5, small()}}, options, 2, 0.5);
  const std::string page = fileText(folder.file("bench.html"));
  for (const char* part : {"alt=\"Time against error", "one &amp; two", "prefers-color-scheme: dark", "@media print",
                           "the default stays", "at most half a step", "data:image/png;base64,"})
    EXPECT_NE(page.find(part), std::string::npos) << part;
  const std::string csv = fileText(folder.file("bench.csv"));
  EXPECT_EQ(csv.rfind("workload,kind,name,row,column,value\n", 0), 0u);
  for (const char* line :
       {"small,table,\"times\",0,\"mean\",1.25\n", "small,sample,\"times: one: mean\",2,\"ns\",2\n",
        "small,curve,\"trade/one & two\",1,\"time (ns)\",4\n", "small,table,\"bounds\",0,\"holds\",\"holds\"\n"})
    EXPECT_NE(csv.find(line), std::string::npos) << line;
}

TEST(BenchProgram, StrictEndsWithFiveWhereAPromiseIsMissed) {
  const test::TempFolder folder;
  // In a quick run without optimization, a tile of 4096 segments is never ready 25 times sooner than CGAL's tree.
  const test::Outcome lax = test::runFiliform({"bench", "index", "--quick", "--out", folder / "lax"});
  ASSERT_EQ(lax.exit_code, 0) << lax.err;
  const auto json = nlohmann::json::parse(test::readBytes(folder / "lax/index.json"));
  const test::Outcome strict = test::runFiliform({"bench", "index", "--quick", "--strict", "--out", folder / "strict"});
  const auto strict_json = nlohmann::json::parse(test::readBytes(folder / "strict/index.json"));
  std::size_t missed = 0;
  for (const auto& goal : strict_json.at("goals")) missed += !goal.at("met_must").get<bool>();
  EXPECT_EQ(strict.exit_code, missed > 0 ? 5 : 0);
  if (missed > 0) {
    EXPECT_TRUE(strict.oneLineOnStderr()) << strict.err;
    EXPECT_NE(strict.err.find(std::to_string(missed) + " promise"), std::string::npos) << strict.err;
  }
  EXPECT_EQ(json.at("goals").size(), strict_json.at("goals").size());
}

TEST(BenchProgram, JsonIsAllThatStdoutHolds) {
  const test::TempFolder folder;
  const test::Outcome run = test::runFiliform({"bench", "index", "--quick", "--json", "--out", folder.path()});
  ASSERT_EQ(run.exit_code, 0) << run.err;
  writeText(folder.file("stdout.json"), run.out);
  EXPECT_EQ(schemaProblems(folder.file("stdout.json")), "");
  EXPECT_EQ(nlohmann::json::parse(run.out).at("workloads").at(0).at("workload"), "index");
  const test::Outcome list = test::runFiliform({"bench", "--list", "--json"});
  ASSERT_EQ(list.exit_code, 0) << list.err;
  const auto json = nlohmann::json::parse(list.out);
  EXPECT_EQ(json.at("workloads").size(), workloads().size());
  EXPECT_TRUE(json.at("peers").contains("Boost"));
}

TEST(BenchProgram, RefusesContradictions) {
  for (const std::vector<std::string>& arguments :
       {std::vector<std::string>{"bench", "index", "index"}, {"bench", "--list", "--strict"}}) {
    const test::Outcome outcome = test::runFiliform(arguments);
    EXPECT_EQ(outcome.exit_code, 2) << arguments.back();
    EXPECT_TRUE(outcome.oneLineOnStderr()) << outcome.err;
  }
}

TEST(BenchProgram, ACorpusWithoutUsableNeuronsIsOneClearLine) {
  const test::TempFolder folder;
  std::filesystem::create_directories(folder / "tiny");
  test::writeBytes(folder / "tiny/a.swc", "1 1 0 0 0 1 -1\n2 3 1 0 0 1 1\n");
  for (const char* workload : {"nearest", "solver"}) {
    const test::Outcome outcome =
        test::runFiliform({"bench", workload, "--corpus", folder / "tiny", "--out", folder / "out"});
    EXPECT_EQ(outcome.exit_code, 2) << outcome.err;
    EXPECT_TRUE(outcome.oneLineOnStderr()) << outcome.err;
    EXPECT_NE(outcome.err.find("--corpus " + (folder / "tiny") + ": no reconstruction"), std::string::npos)
        << outcome.err;
  }
}

TEST(BenchIngest, IsTheMedianOfAtLeastFiveRuns) {
  for (const std::uint64_t segments : {10'000ull, 1'000'000ull, 200'000'000ull})
    EXPECT_GE(ingestRuns(segments, false), 5);
}

TEST(BatchMedians, SplitsValuesInOrder) {
  EXPECT_TRUE(batchMedians({}).empty());
  EXPECT_EQ(batchMedians({3, 1}), (std::vector<double>{3, 1}));
  std::vector<double> values;
  for (int i = 0; i < 27; ++i) values.push_back(i);
  EXPECT_EQ(batchMedians(values), (std::vector<double>{1, 4, 7, 10, 13, 16, 19, 22, 25}));
}

TEST(BenchProgram, UnknownWorkloadIsRefusedWithTheChoices) {
  const test::Outcome outcome = test::runFiliform({"bench", "nonsense"});
  EXPECT_EQ(outcome.exit_code, 2);
  EXPECT_TRUE(outcome.oneLineOnStderr()) << outcome.err;
  for (const Workload& workload : workloads())
    EXPECT_NE(outcome.err.find(workload.name), std::string::npos) << workload.name;
}

}  // namespace
}  // namespace filiform::tools
