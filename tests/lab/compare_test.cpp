#include "tools/lab/bench/compare.h"

#include "index/errors.h"
#include "tests/support/process.h"
#include "tests/support/temp_folder.h"
#include "tools/lab/bench/bench_record.h"

#include <algorithm>
#include <cmath>
#include <random>

#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

namespace filiform::tools {
namespace {

// By the definition: every division of all values into two groups.
double chanceByEnumeration(const std::vector<double>& a, const std::vector<double>& b) {
  std::vector<double> all(a);
  all.insert(all.end(), b.begin(), b.end());
  const auto rank = [&](double v) {
    double below = 0, same = 0;
    for (const double w : all) below += w < v, same += w == v;
    return below + (same + 1) / 2;
  };
  const double mean = static_cast<double>(a.size()) * static_cast<double>(all.size() + 1) / 2;
  double sum = 0;
  for (const double v : a) sum += rank(v);
  double far = 0, choices = 0;
  for (unsigned mask = 0; mask < 1u << all.size(); ++mask) {
    if (__builtin_popcount(mask) != static_cast<int>(a.size())) continue;
    double other = 0;
    for (std::size_t i = 0; i < all.size(); ++i)
      if (mask >> i & 1) other += rank(all[i]);
    far += std::abs(other - mean) >= std::abs(sum - mean) - 1e-9;
    ++choices;
  }
  return far / choices;
}

TEST(RankSum, IsTheShareOfDivisionsThatLieAsFarApart) {
  std::mt19937_64 random(5);
  for (int round = 0; round < 60; ++round) {
    std::vector<double> a(1 + random() % 5), b(1 + random() % 6);
    for (double& v : a) v = static_cast<double>(random() % 6);  // with ties
    for (double& v : b) v = static_cast<double>(random() % 6);
    EXPECT_NEAR(rankSumChance(a, b), chanceByEnumeration(a, b), 1e-12) << "round " << round;
  }
  EXPECT_NEAR(rankSumChance({1, 2, 3, 4, 5}, {6, 7, 8, 9, 10}), 2.0 / 252, 1e-12);
  EXPECT_EQ(rankSumChance({}, {1}), 1);
}

TEST(RankSum, IsCloseToTheExactChanceBeyondSixtyValues) {
  // Exact: shifts of 30 against 30. Approximate: the same with one more value, which changes little.
  std::mt19937_64 random(7);
  for (const double shift : {0.0, 1.0, 2.0, 4.0}) {
    std::vector<double> a, b;
    for (int i = 0; i < 30; ++i) {
      a.push_back(static_cast<double>(random() % 12));
      b.push_back(static_cast<double>(random() % 12) + shift);
    }
    const double exact = rankSumChance(a, b);
    b.push_back(percentile(b, 0.5));
    EXPECT_NEAR(rankSumChance(a, b), exact, 0.03 + 0.2 * exact) << shift;
  }
  EXPECT_EQ(rankSumChance(std::vector<double>(400, 1.0), std::vector<double>(400, 1.0)), 1);
  EXPECT_LT(rankSumChance(std::vector<double>(400, 1.0), std::vector<double>(400, 2.0)), 1e-12);
}

TEST(Holm, MultipliesTheSmallestByAllAndNeverFalls) {
  EXPECT_TRUE(holmCorrected({}).empty());
  const std::vector<double> corrected = holmCorrected({0.04, 0.01, 0.02, 0.9});
  const std::vector<double> expected{0.08, 0.04, 0.06, 0.9};
  for (std::size_t i = 0; i < expected.size(); ++i) EXPECT_NEAR(corrected[i], expected[i], 1e-12) << i;
  EXPECT_EQ(holmCorrected({0.02, 0.021})[1], 0.04);
  EXPECT_EQ(holmCorrected({0.7, 0.8, 0.9})[0], 1);
}

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

  test::TempFolder folder_;
};

BenchSample sampleOf(const std::string& what, const std::string& unit, bool more_is_better,
                     const std::vector<double>& batches) {
  return {"figures", {what}, "median", unit, more_is_better, batches};
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
  const RunComparison comparison = compareRuns(a, b);
  std::vector<std::string> flagged;
  for (const Comparison& c : comparison.figures)
    if (c.regression) flagged.push_back(c.name);
  EXPECT_EQ(flagged, (std::vector<std::string>{"figures: slower: median", "figures: fewer: median"}));
  ASSERT_EQ(comparison.figures.size(), 6u);
  EXPECT_DOUBLE_EQ(comparison.figures[0].ratio, 2);
  EXPECT_EQ(comparison.figures[5].chance, 1);
  EXPECT_FALSE(comparison.figures[5].tested);
  EXPECT_EQ(comparison.tested(), 5u);
  EXPECT_EQ(comparison.only_a, (std::vector<std::string>{"work: figures: gone: median"}));
  EXPECT_EQ(comparison.only_b, (std::vector<std::string>{"work: figures: new: median"}));
  const std::string text = comparisonMarkdown(comparison);
  for (const char* part : {"seed differs: 1 and 2", "in the first run only: 1\n  - work: figures: gone: median",
                           "in the second run only: 1\n  - work: figures: new: median", "2 regressions", "not tested"})
    EXPECT_NE(text.find(part), std::string::npos) << part << "\n" << text;
  EXPECT_EQ(test::runFiliform({"bench", "--compare", a, b}).exit_code, 4);
  EXPECT_EQ(test::runFiliform({"bench", "--compare", b, b}).exit_code, 0);
}

std::vector<double> nineFrom(double least) {
  std::vector<double> batches;
  for (int i = 0; i < kBatches; ++i) batches.push_back(least + 0.1 * i);
  return batches;
}

// An earlier version compared both figures of one name with the second, and missed a tenfold regression of the first.
TEST_F(CompareRuns, TellsFiguresOfOneNameApartByTableRowAndColumn) {
  const auto of = [](double warm, double cold, double other) {
    return std::vector<BenchSample>{{"warm", {"climb"}, "mean", "ns", false, nineFrom(warm)},
                                    {"cold", {"climb"}, "mean", "ns", false, nineFrom(cold)},
                                    {"cold", {"basic"}, "mean", "ns", false, nineFrom(cold)},
                                    {"cold", {"basic"}, "most", "ns", false, nineFrom(other)},
                                    {"cold", {"basic", 3.0}, "mean", "ns", false, nineFrom(cold)}};
  };
  const std::string a = run("a", of(10, 50, 70)), b = run("b", of(100, 50, 700));
  const RunComparison comparison = compareRuns(a, b);
  std::vector<std::string> flagged;
  for (const Comparison& c : comparison.figures)
    if (c.regression) flagged.push_back(c.name);
  EXPECT_EQ(flagged, (std::vector<std::string>{"warm: climb: mean", "cold: basic: most"}));
  EXPECT_EQ(comparison.figures.size(), 5u);
  const test::Outcome outcome = test::runFiliform({"bench", "--compare", a, b});
  EXPECT_EQ(outcome.exit_code, 4);
  EXPECT_NE(outcome.out.find("| warm: climb: mean | ns |"), std::string::npos) << outcome.out;
  const test::Outcome as_json = test::runFiliform({"bench", "--compare", a, b, "--json"});
  EXPECT_EQ(as_json.exit_code, 4);
  const auto json = nlohmann::json::parse(as_json.out);
  EXPECT_EQ(json.at("regressions"), 2);
  EXPECT_EQ(json.at("figures").at(0).at("figure"), "warm: climb: mean");
  EXPECT_EQ(json.at("figures").at(0).at("regression"), true);
}

TEST_F(CompareRuns, PairsRepeatedFiguresInOrderAndSaysSo) {
  const BenchSample fast{"warm", {"climb"}, "mean", "ns", false, nineFrom(10)};
  BenchSample slow = fast;
  slow.batches = nineFrom(100);
  const std::string twice = run("twice", {fast, fast}), worse = run("worse", {slow, fast}), once = run("once", {fast});
  const RunComparison comparison = compareRuns(twice, worse);
  ASSERT_EQ(comparison.figures.size(), 2u);
  EXPECT_TRUE(comparison.figures[0].regression);
  EXPECT_FALSE(comparison.figures[1].regression);
  EXPECT_NE(comparisonMarkdown(comparison).find("compared in the order of the files"), std::string::npos);
  EXPECT_EQ(compareRuns(twice, once).only_a, (std::vector<std::string>{"work: warm: climb: mean #2"}));
  EXPECT_EQ(compareRuns(once, twice).only_b, (std::vector<std::string>{"work: warm: climb: mean #2"}));
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
  const RunComparison comparison = compareRuns(a, b);
  // The sample replaces the number in the table.
  ASSERT_EQ(comparison.figures.size(), 4u);
  EXPECT_EQ(comparison.tested(), 1u);
  EXPECT_EQ(comparison.regressions(), 0u);
  const std::string text = comparisonMarkdown(comparison);
  EXPECT_NE(text.find("| cold: column, climb: most |"), std::string::npos) << text;
  EXPECT_EQ(text.find("| cold: column, basic: mean |"), std::string::npos) << text;
  EXPECT_NE(text.find("3 figures have one value a run and are not tested; 1 of them"), std::string::npos) << text;
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
  const RunComparison comparison = compareRuns(run("a", first), run("b", second));
  std::size_t uncorrected = 0;
  for (const Comparison& c : comparison.figures) uncorrected += c.chance < kSignificant && c.ratio > 1 + kRegression;
  EXPECT_GE(uncorrected, 10u);
  EXPECT_EQ(comparison.regressions(), 1u);
  EXPECT_TRUE(comparison.figures[500].regression);
  EXPECT_NE(comparisonMarkdown(comparison).find("(Holm)"), std::string::npos);
}

TEST_F(CompareRuns, SaysWhereBatchesAreTooFew) {
  std::vector<BenchSample> samples;
  for (int i = 0; i < 20; ++i) samples.push_back(sampleOf(std::to_string(i), "ns", false, {1, 2, 3, 4, 5}));
  const std::string a = run("a", samples);
  EXPECT_NE(comparisonMarkdown(compareRuns(a, a)).find("20 figures have too few batches"), std::string::npos);
  samples.resize(1);
  const std::string b = run("b", samples);
  EXPECT_EQ(comparisonMarkdown(compareRuns(b, b)).find("too few batches"), std::string::npos);
}

TEST_F(CompareRuns, RefusesWhatIsNoRun) {
  EXPECT_THROW(compareRuns(folder_.file("none.json"), folder_.file("none.json")), IoError);
  const std::string a = run("a", {});
  for (const char* text : {"", "{}", "[1]", "{\"format\": \"filiform-bench-1\"}",
                           "{\"format\": \"filiform-bench-1\", \"workloads\": [{}]}"}) {
    writeText(folder_.file("bad.json"), text);
    EXPECT_THROW(compareRuns(a, folder_.file("bad.json")), InputError) << text;
  }
  const test::Outcome outcome = test::runFiliform({"bench", "--compare", a, folder_.file("bad.json")});
  EXPECT_EQ(outcome.exit_code, 1);
  EXPECT_TRUE(outcome.oneLineOnStderr()) << outcome.err;
}

}  // namespace
}  // namespace filiform::tools
