#include "tools/bench/compare.h"

#include "index/errors.h"
#include "tests/support/process.h"
#include "tests/support/temp_folder.h"
#include "tools/bench/bench_record.h"

#include <algorithm>
#include <cmath>
#include <random>

#include <gtest/gtest.h>

namespace filiform::tools {
namespace {

// By its definition: every division of all values into two groups.
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

class CompareRuns : public ::testing::Test {
 protected:
  std::string run(const std::string& name, const std::vector<BenchSample>& samples, std::uint64_t seed = 1) {
    BenchOptions options;
    options.out = folder_.file(name);
    options.seed = seed;
    std::filesystem::create_directories(options.out);
    BenchReport report;
    report.samples = samples;
    writeBenchRun({{"work", "some work", 1, report}}, options, 1, 0);
    return options.out + "/bench.json";
  }

  test::TempFolder folder_;
};

TEST_F(CompareRuns, FlagsOnlyWhatIsWorseBeyondTenPercentAndItsSpread) {
  const std::string a = run("a", {{"slower", "ns", false, {10, 11, 10, 11, 10}},
                                  {"scattered", "ns", false, {10, 30, 10, 30, 10}},
                                  {"a little", "ns", false, {100, 101, 100, 101, 100}},
                                  {"fewer", "1/s", true, {50, 51, 52, 50, 51}},
                                  {"faster", "ns", false, {10, 11, 10, 11, 10}},
                                  {"once", "ns", false, {10}},
                                  {"gone", "ns", false, {1, 2}}});
  const std::string b = run("b",
                            {{"slower", "ns", false, {20, 21, 20, 21, 20}},
                             {"scattered", "ns", false, {12, 30, 30, 9, 31}},
                             {"a little", "ns", false, {105, 106, 105, 106, 105}},
                             {"fewer", "1/s", true, {30, 31, 32, 30, 31}},
                             {"faster", "ns", false, {5, 6, 5, 6, 5}},
                             {"once", "ns", false, {100}}},
                            2);
  const RunComparison comparison = compareRuns(a, b);
  std::vector<std::string> flagged;
  for (const Comparison& c : comparison.figures)
    if (c.regression) flagged.push_back(c.name);
  EXPECT_EQ(flagged, (std::vector<std::string>{"slower", "fewer"}));
  EXPECT_EQ(comparison.figures.size(), 6u);
  EXPECT_DOUBLE_EQ(comparison.figures[0].ratio, 2);
  EXPECT_EQ(comparison.figures[5].chance, 1);
  const std::string text = comparisonMarkdown(comparison);
  for (const char* part : {"seed differs: 1 and 2", "1 figures of the first are not in the second", "2 regressions"})
    EXPECT_NE(text.find(part), std::string::npos) << part << "\n" << text;
  EXPECT_EQ(test::runFiliform({"bench", "--compare", a, b}).exit_code, 4);
  EXPECT_EQ(test::runFiliform({"bench", "--compare", b, b}).exit_code, 0);
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
