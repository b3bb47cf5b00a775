#include "tools/bench/compare.h"

#include "index/errors.h"
#include "index/text.h"

#include <algorithm>
#include <cerrno>
#include <cmath>
#include <fstream>
#include <map>

#include <nlohmann/json.hpp>

namespace filiform::tools {

namespace {

using nlohmann::json;

json readRun(const std::string& path) {
  std::ifstream file(path, std::ios::binary);
  if (!file) throw IoError(escaped(path), "cannot read", errno);
  json run = json::parse(file, nullptr, false);
  if (!run.is_object() || run.value("format", "") != "filiform-bench-1" || !run.contains("workloads"))
    throw InputError(escaped(path) + ": not a bench.json of filiform bench");
  return run;
}

std::map<std::pair<std::string, std::string>, BenchSample> samplesOf(
    const json& run, std::vector<std::pair<std::string, std::string>>* order) {
  std::map<std::pair<std::string, std::string>, BenchSample> all;
  for (const json& workload : run.at("workloads")) {
    if (!workload.contains("samples")) continue;
    for (const json& sample : workload.at("samples")) {
      BenchSample one{sample.at("name"), sample.at("unit"), sample.at("more_is_better"), {}};
      for (const json& value : sample.at("batches"))
        if (value.is_number()) one.batches.push_back(value);
      const std::pair<std::string, std::string> key(workload.at("workload"), one.name);
      if (order != nullptr) order->push_back(key);
      all[key] = std::move(one);
    }
  }
  return all;
}

}  // namespace

std::size_t RunComparison::regressions() const {
  return static_cast<std::size_t>(
      std::count_if(figures.begin(), figures.end(), [](const Comparison& c) { return c.regression; }));
}

double rankSumChance(const std::vector<double>& a, const std::vector<double>& b) {
  if (a.empty() || b.empty()) return 1;
  std::vector<double> all(a);
  all.insert(all.end(), b.begin(), b.end());
  std::sort(all.begin(), all.end());
  // Twice the mean rank, so that ties stay whole numbers.
  const auto rank2 = [&](double value) {
    const auto [lo, hi] = std::equal_range(all.begin(), all.end(), value);
    return static_cast<std::size_t>((lo - all.begin()) + (hi - all.begin()) + 1);
  };
  std::size_t sum = 0, total = 0;
  for (const double value : a) sum += rank2(value);
  for (const double value : all) total += rank2(value);
  // ways[k][s]: how many choices of k values have rank sum s.
  std::vector<std::vector<double>> ways(a.size() + 1, std::vector<double>(total + 1, 0));
  ways[0][0] = 1;
  for (const double value : all) {
    const std::size_t rank = rank2(value);
    for (std::size_t k = a.size(); k-- > 0;)
      for (std::size_t s = total - rank + 1; s-- > 0;) ways[k + 1][s + rank] += ways[k][s];
  }
  const double mean = static_cast<double>(total) * static_cast<double>(a.size()) / static_cast<double>(all.size());
  const double off = std::abs(static_cast<double>(sum) - mean);
  double as_far = 0, choices = 0;
  for (std::size_t s = 0; s <= total; ++s) {
    choices += ways[a.size()][s];
    if (std::abs(static_cast<double>(s) - mean) >= off - 1e-9) as_far += ways[a.size()][s];
  }
  return as_far / choices;
}

RunComparison compareRuns(const std::string& path_a, const std::string& path_b) {
  const json a = readRun(path_a), b = readRun(path_b);
  RunComparison comparison;
  try {
    for (const char* what : {"processor", "threads", "compiler", "flags", "assertions"})
      if (a.at("machine").at(what) != b.at("machine").at(what))
        comparison.notes.push_back(std::string(what) + " differs: " + a.at("machine").at(what).dump() + " and " +
                                   b.at("machine").at(what).dump());
    for (const char* what : {"seed", "size", "quick", "long", "corpus"})
      if (a.at(what) != b.at(what))
        comparison.notes.push_back(std::string(what) + " differs: " + a.at(what).dump() + " and " + b.at(what).dump());
    comparison.notes.push_back("commits " + a.at("machine").at("commit").get<std::string>() + " and " +
                               b.at("machine").at("commit").get<std::string>() + "; load before " +
                               a.at("load_before").dump() + " and " + b.at("load_before").dump());
    std::vector<std::pair<std::string, std::string>> order;
    const auto in_a = samplesOf(a, &order), in_b = samplesOf(b, nullptr);
    std::size_t only_a = 0;
    for (const auto& key : order) {
      const auto found = in_b.find(key);
      if (found == in_b.end()) {
        ++only_a;
        continue;
      }
      const BenchSample &old = in_a.at(key), &now = found->second;
      if (old.batches.empty() || now.batches.empty()) continue;
      Comparison c{key.first, key.second, old.unit, percentile(old.batches, 0.5), percentile(now.batches, 0.5)};
      c.ratio = c.b / c.a;
      if (old.batches.size() > 1 && now.batches.size() > 1) c.chance = rankSumChance(old.batches, now.batches);
      const double worse = old.more_is_better ? c.a / c.b : c.ratio;
      c.regression = worse > 1 + kRegression && c.chance < kSignificant;
      comparison.figures.push_back(std::move(c));
    }
    if (only_a > 0) comparison.notes.push_back(std::to_string(only_a) + " figures of the first are not in the second");
    if (in_b.size() + only_a > in_a.size())
      comparison.notes.push_back(std::to_string(in_b.size() + only_a - in_a.size()) +
                                 " figures of the second are not in the first");
  } catch (const json::exception& error) {
    throw InputError(escaped(path_a) + " and " + escaped(path_b) +
                     ": not as bench.schema.json has it: " + error.what());
  }
  return comparison;
}

std::string comparisonMarkdown(const RunComparison& comparison) {
  BenchTable table{"comparison",
                   "Medians of two runs; chance: that ranks lie so far apart by chance",
                   {"workload", "figure", "unit", "first", "second", "ratio", "chance", ""},
                   {}};
  for (const Comparison& c : comparison.figures)
    table.rows.push_back({c.workload, c.name, c.unit, c.a, c.b, c.ratio, c.chance,
                          std::string(c.regression              ? "**regression**"
                                      : c.chance < kSignificant ? "changed"
                                                                : "")});
  std::string text = markdownTable(table);
  text += '\n';
  for (const std::string& note : comparison.notes) text += "- " + note + "\n";
  text += "- " + std::to_string(comparison.regressions()) + " regressions of more than 10 %\n";
  return text;
}

}  // namespace filiform::tools
