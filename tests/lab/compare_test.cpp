// The script tools/lab/bench/compare, on runs that the program writes.
#include "tests/support/folders.h"
#include "tests/support/process.h"
#include "tests/support/temp_folder.h"
#include "tools/lab/bench/bench_record.h"

#include <filesystem>
#include <random>

#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

namespace filiform::tools {
namespace {

using nlohmann::json;

class CompareRuns : public ::testing::Test {
 protected:
  std::string run(const std::string& name, const std::vector<BenchSample>& samples, std::uint64_t seed = 1,
                  const std::vector<BenchTable>& tables = {}) {
    BenchOptions options;
    options.out = folder_.file(name);
    options.seed = seed;
    std::filesystem::create_directories(options.out);
    BenchReport report;
    report.samples = samples;
    report.tables = tables;
    writeBenchRun({{"work", "some work", 1, report}}, options, 1, 0);
    return options.out + "/bench.json";
  }

  static test::Outcome compare(const std::vector<std::string>& arguments) {
    return test::runFiliformInShell("shift; exec '" + test::inSource("tools/lab/bench/compare") + "' \"$@\"",
                                    arguments);
  }

  static json compared(const std::string& a, const std::string& b) {
    const test::Outcome outcome = compare({"--json", a, b});
    json result = json::parse(outcome.out, nullptr, false);
    EXPECT_TRUE(result.is_object()) << outcome.err;
    EXPECT_EQ(outcome.exit_code, result.at("regressions") > 0 ? 4 : 0);
    return result;
  }

  static std::vector<std::string> flagged(const json& result) {
    std::vector<std::string> names;
    for (const json& figure : result.at("figures"))
      if (figure.at("regression")) names.push_back(figure.at("figure"));
    return names;
  }

  test::TempFolder folder_;
};

BenchSample sampleOf(const std::string& what, const std::string& unit, bool more_is_better,
                     const std::vector<double>& batches) {
  return {"t", {what}, "median", unit, more_is_better, batches};
}

TEST_F(CompareRuns, FlagsOnlyWhatIsWorseBeyondTenPercentAndItsSpread) {
  const std::string a = run(
      "a",
      {sampleOf("slower", "ns", false, {10, 11, 10, 11, 10}), sampleOf("scattered", "ns", false, {10, 30, 10, 30, 10}),
       sampleOf("a little", "ns", false, {100, 101, 100, 101, 100}),
       sampleOf("fewer", "1/s", true, {50, 51, 52, 50, 51}), sampleOf("faster", "ns", false, {10, 11, 10, 11, 10}),
       sampleOf("once", "ns", false, {10}), sampleOf("gone", "ns", false, {1, 2})});
  const std::string b = run(
      "b",
      {sampleOf("slower", "ns", false, {20, 21, 20, 21, 20}), sampleOf("scattered", "ns", false, {12, 30, 30, 9, 31}),
       sampleOf("a little", "ns", false, {105, 106, 105, 106, 105}),
       sampleOf("fewer", "1/s", true, {30, 31, 32, 30, 31}), sampleOf("faster", "ns", false, {5, 6, 5, 6, 5}),
       sampleOf("once", "ns", false, {100}), sampleOf("new", "ns", false, {1, 2})},
      2);
  const json result = compared(a, b);
  EXPECT_EQ(flagged(result), (std::vector<std::string>{"t: slower: median", "t: fewer: median"}));
  ASSERT_EQ(result.at("figures").size(), 6u);
  EXPECT_EQ(result.at("figures")[0].at("ratio"), 2);
  EXPECT_EQ(result.at("figures")[5].at("tested"), false);
  EXPECT_EQ(result.at("tested"), 5);
  EXPECT_EQ(result.at("only_first"), json({"work: t: gone: median"}));
  EXPECT_EQ(result.at("only_second"), json({"work: t: new: median"}));
  const std::string text = compare({a, b}).out;
  for (const char* part : {"seed differs: 1 and 2", "| t: slower: median | ns | 10 | 20 | 2 |", "2 regressions",
                           "1 figures have one value a run and are not tested; 1 of them differ"})
    EXPECT_NE(text.find(part), std::string::npos) << part << "\n" << text;
}

TEST_F(CompareRuns, TheChanceIsExactAlsoWithTies) {
  // 2 of the 252 divisions lie as far apart; with ranks 1, 3, 3, 3, 5.5, 5.5, 6 of 20.
  const json result =
      compared(run("a", {sampleOf("apart", "", false, {1, 2, 3, 4, 5}), sampleOf("tied", "", false, {1, 2, 2})}),
               run("b", {sampleOf("apart", "", false, {6, 7, 8, 9, 10}), sampleOf("tied", "", false, {2, 3, 3})}));
  EXPECT_NEAR(result.at("figures")[0].at("chance"), 2.0 / 252, 1e-12);
  EXPECT_NEAR(result.at("figures")[0].at("corrected"), 4.0 / 252, 1e-12);
  EXPECT_NEAR(result.at("figures")[1].at("chance"), 0.3, 1e-12);
  EXPECT_NEAR(result.at("figures")[1].at("corrected"), 0.3, 1e-12);
}

std::vector<double> nineFrom(double least) {
  std::vector<double> batches;
  for (int i = 0; i < kBatches; ++i) batches.push_back(least + 0.1 * i);
  return batches;
}

// An earlier version compared both figures of one name with the second, and missed a tenfold regression of the first.
TEST_F(CompareRuns, TellsFiguresOfOneNameApartByTableRowAndColumnThenByOrder) {
  const auto of = [](double warm, double cold, double other) {
    return std::vector<BenchSample>{{"warm", {"climb"}, "mean", "ns", false, nineFrom(warm)},
                                    {"cold", {"climb"}, "mean", "ns", false, nineFrom(cold)},
                                    {"cold", {"basic"}, "mean", "ns", false, nineFrom(cold)},
                                    {"cold", {"basic"}, "most", "ns", false, nineFrom(other)},
                                    {"cold", {"basic", 3.0}, "mean", "ns", false, nineFrom(cold)},
                                    {"cold", {"basic", 3.0}, "mean", "ns", false, nineFrom(other)}};
  };
  const json result = compared(run("a", of(10, 50, 70)), run("b", of(100, 50, 700)));
  EXPECT_EQ(flagged(result),
            (std::vector<std::string>{"warm: climb: mean", "cold: basic: most", "cold: basic, 3.0: mean #2"}));
  EXPECT_EQ(result.at("figures").size(), 6u);
}

TEST_F(CompareRuns, ShowsNumbersOfTablesThatDifferMuchAndDoesNotFlagThem) {
  const auto of = [](double mean, double most) {
    BenchTable table{"cold", "", {"scene", "method", "mean", "most", "word"}, {}, {"scene", "method"}};
    table.rows.push_back({std::string("column"), std::string("climb"), mean, most, std::string("text")});
    table.rows.push_back({std::string("column"), std::string("basic"), 1.0, 2.0, std::string("text")});
    return table;
  };
  const std::vector<BenchSample> samples{{"cold", {"column", "climb"}, "mean", "ns", false, nineFrom(10)}};
  const std::string a = run("a", samples, 1, {of(10.4, 5)}), b = run("b", samples, 1, {of(10.4, 50)});
  const json result = compared(a, b);
  ASSERT_EQ(result.at("figures").size(), 4u) << "the sample replaces the number in the table";
  EXPECT_EQ(result.at("tested"), 1);
  EXPECT_EQ(result.at("regressions"), 0);
  const std::string text = compare({a, b}).out;
  EXPECT_NE(text.find("| cold: column, climb: most |"), std::string::npos) << text;
  EXPECT_EQ(text.find("| cold: column, basic: mean |"), std::string::npos) << text;
}

// One unchanged figure in twenty has a chance below .05. Among a thousand unchanged figures hardly any may be flagged,
// and a changed one must be flagged.
TEST_F(CompareRuns, CorrectsForTheNumberOfFigures) {
  std::mt19937_64 random(11);
  std::lognormal_distribution<double> noise(0, 0.5);
  std::vector<BenchSample> first, second;
  for (int i = 0; i < 1000; ++i) {
    BenchSample sample = sampleOf(std::to_string(i), "ns", false, {});
    for (std::vector<BenchSample>* all : {&first, &second}) {
      sample.batches.clear();
      for (int batch = 0; batch < kBatches; ++batch) sample.batches.push_back(noise(random));
      all->push_back(sample);
    }
  }
  for (double& ns : second[500].batches) ns *= 100;
  const json result = compared(run("a", first), run("b", second));
  std::size_t uncorrected = 0;
  for (const json& c : result.at("figures")) uncorrected += c.at("chance") < 0.05 && c.at("ratio") > 1.1;
  EXPECT_GE(uncorrected, 10u);
  EXPECT_EQ(flagged(result), std::vector<std::string>{"t: 500: median"});
}

TEST_F(CompareRuns, SaysWhereBatchesAreTooFew) {
  std::vector<BenchSample> samples;
  for (int i = 0; i < 20; ++i) samples.push_back(sampleOf(std::to_string(i), "ns", false, {1, 2, 3, 4, 5}));
  const std::string a = run("a", samples);
  EXPECT_NE(compare({a, a}).out.find("20 figures have too few batches"), std::string::npos);
  samples.resize(1);
  const std::string b = run("b", samples);
  EXPECT_EQ(compare({b, b}).out.find("too few batches"), std::string::npos);
}

TEST_F(CompareRuns, RefusesWhatIsNoRun) {
  const std::string a = run("a", {});
  EXPECT_EQ(compare({a, a}).exit_code, 0);
  EXPECT_EQ(compare({a}).exit_code, 2);
  EXPECT_EQ(compare({a, folder_.file("none.json")}).exit_code, 1);
  for (const char* text : {"", "{}", "[1]", "{\"format\": \"filiform-bench-1\"}",
                           "{\"format\": \"filiform-bench-1\", \"workloads\": [{}]}"}) {
    writeText(folder_.file("bad.json"), text);
    const test::Outcome outcome = compare({a, folder_.file("bad.json")});
    EXPECT_EQ(outcome.exit_code, 1) << text;
    EXPECT_TRUE(outcome.oneLineOnStderr()) << outcome.err;
  }
}

}  // namespace
}  // namespace filiform::tools
