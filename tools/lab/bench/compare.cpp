#include "tools/lab/bench/compare.h"

#include "index/errors.h"
#include "index/text.h"

#include <algorithm>
#include <cerrno>
#include <cmath>
#include <fstream>
#include <map>
#include <numeric>
#include <set>

#include <nlohmann/json.hpp>

namespace filiform::tools {

namespace {

using nlohmann::json;

constexpr std::size_t kMostExact = 60;  // values in both groups; the exact test takes the cube of their number

json readRun(const std::string& path) {
  std::ifstream file(path, std::ios::binary);
  if (!file) throw IoError(escaped(path), "cannot read", errno);
  json run = json::parse(file, nullptr, false);
  if (!run.is_object() || run.value("format", "") != "filiform-bench-1" || !run.contains("workloads"))
    throw InputError(escaped(path) + ": not a bench.json of filiform bench");
  return run;
}

struct FigureId {
  std::string workload, table;
  std::vector<std::string> row;
  std::string column;
  auto operator<=>(const FigureId&) const = default;

  std::string name() const {
    std::string text = table;
    for (std::size_t i = 0; i < row.size(); ++i) text += (i > 0 ? ", " : text.empty() ? "" : ": ") + row[i];
    return text + (column.empty() ? "" : ": " + column);
  }
};

struct Figure {
  FigureId id;
  std::string unit;
  bool more_is_better = false;
  std::vector<double> batches;
};

// The text by which a value of a key column identifies a row.
std::string keyText(const json& value) { return value.is_string() ? value.get<std::string>() : value.dump(); }

// Samples of version 0.1 have only a name and a unit.
Figure sampleFigure(const std::string& workload, const json& sample) {
  Figure figure{{workload, "", {}, ""}, sample.at("unit"), sample.at("more_is_better"), {}};
  if (sample.contains("table")) {
    figure.id.table = sample.at("table");
    for (const json& value : sample.at("row")) figure.id.row.push_back(keyText(value));
    figure.id.column = sample.at("column");
  } else {
    figure.id.row.push_back(sample.at("name"));
  }
  for (const json& value : sample.at("batches"))
    if (value.is_number()) figure.batches.push_back(value);
  return figure;
}

// The samples of all workloads, and the numbers in their tables that are not medians of samples.
std::vector<Figure> figuresOf(const json& run) {
  std::vector<Figure> figures;
  for (const json& workload : run.at("workloads")) {
    const std::string name = workload.at("workload");
    std::set<FigureId> sampled;
    for (const json& sample : workload.value("samples", json::array())) {
      figures.push_back(sampleFigure(name, sample));
      sampled.insert(figures.back().id);
    }
    const json tables = workload.value("tables", json::object());
    for (const auto& [table, content] : tables.items()) {
      if (!content.contains("keys")) continue;
      const std::vector<std::string> keys = content.at("keys");
      for (const json& row : content.at("rows")) {
        FigureId id{name, table, {}, ""};
        for (const std::string& key : keys) id.row.push_back(keyText(row.at(key)));
        for (const auto& [column, value] : row.items()) {
          if (!value.is_number() || std::find(keys.begin(), keys.end(), column) != keys.end()) continue;
          id.column = column;
          if (!sampled.contains(id)) figures.push_back({id, "", false, {value.get<double>()}});
        }
      }
    }
  }
  return figures;
}

using FigureMap = std::map<FigureId, std::vector<const Figure*>>;

FigureMap byId(const std::vector<Figure>& figures) {
  FigureMap all;
  for (const Figure& figure : figures) all[figure.id].push_back(&figure);
  return all;
}

Comparison compared(const Figure& old, const Figure& now, const std::string& name) {
  Comparison c{old.id.workload, name, old.unit, percentile(old.batches, 0.5), percentile(now.batches, 0.5)};
  c.ratio = c.b / c.a;
  c.tested = old.batches.size() > 1 && now.batches.size() > 1;
  if (c.tested) c.chance = rankSumChance(old.batches, now.batches);
  return c;
}

void compareFigures(const std::vector<Figure>& figures_a, const std::vector<Figure>& figures_b,
                    RunComparison& comparison) {
  const FigureMap in_a = byId(figures_a), in_b = byId(figures_b);
  std::map<FigureId, std::size_t> met;
  std::vector<bool> more_is_better;
  std::size_t repeated = 0;
  for (const Figure& old : figures_a) {
    const std::size_t at = met[old.id]++;
    const std::size_t count = in_a.at(old.id).size();
    const auto found = in_b.find(old.id);
    std::string name = old.id.name();
    if (count > 1) name += " #" + std::to_string(at + 1);
    if (found == in_b.end() || at >= found->second.size()) {
      comparison.only_a.push_back(old.id.workload + ": " + name);
      continue;
    }
    repeated += count > 1;
    const Figure& now = *found->second[at];
    if (old.batches.empty() || now.batches.empty()) continue;
    comparison.figures.push_back(compared(old, now, name));
    more_is_better.push_back(old.more_is_better);
  }
  if (repeated > 0)
    comparison.notes.push_back(std::to_string(repeated) +
                               " figures share table, row and column with another: compared in the order of the files");
  met.clear();
  for (const Figure& now : figures_b) {
    const std::size_t at = met[now.id]++;
    const auto found = in_a.find(now.id);
    if (found == in_a.end() || at >= found->second.size())
      comparison.only_b.push_back(now.id.workload + ": " + now.id.name() +
                                  (in_b.at(now.id).size() > 1 ? " #" + std::to_string(at + 1) : ""));
  }
  std::vector<double> chances;
  for (const Comparison& c : comparison.figures)
    if (c.tested) chances.push_back(c.chance);
  const std::vector<double> corrected = holmCorrected(chances);
  std::size_t next = 0;
  for (std::size_t i = 0; i < comparison.figures.size(); ++i) {
    Comparison& c = comparison.figures[i];
    if (!c.tested) continue;
    c.corrected = corrected[next++];
    const double worse = more_is_better[i] ? c.a / c.b : c.ratio;
    c.regression = worse > 1 + kRegression && c.corrected < kSignificant;
  }
}

double choose(std::size_t n, std::size_t k) {
  double ways = 1;
  for (std::size_t i = 1; i <= k; ++i) ways *= static_cast<double>(n - k + i) / static_cast<double>(i);
  return ways;
}

// Adds a note if the batches are too few: Holm's first step requires a chance below kSignificant / figures.
void noteTooFewBatches(const std::vector<Figure>& figures_a, const std::vector<Figure>& figures_b,
                       RunComparison& comparison) {
  const std::size_t tested = comparison.tested();
  const FigureMap in_b = byId(figures_b);
  std::size_t hidden = 0;
  for (const Figure& old : figures_a) {
    const auto found = in_b.find(old.id);
    if (found == in_b.end()) continue;
    const std::size_t n = old.batches.size(), m = found->second.front()->batches.size();
    if (n < 2 || m < 2) continue;
    hidden += 2 / choose(n + m, n) * static_cast<double>(tested) >= kSignificant;
  }
  if (hidden > 0)
    comparison.notes.push_back(std::to_string(hidden) + " figures have too few batches to show a change among " +
                               std::to_string(tested) + " comparisons: compare runs of fewer workloads");
}

// Untested figures are shown in the Markdown only if they differ much.
bool differsMuch(const Comparison& c) {
  if (c.a == c.b) return false;
  return !(c.ratio <= 2 && c.ratio >= 0.5);
}

void listNames(const std::vector<std::string>& names, const std::string& which, std::string& text) {
  constexpr std::size_t kMost = 20;
  if (names.empty()) return;
  text += "- Figures in the " + which + " run only: " + std::to_string(names.size()) + "\n";
  for (std::size_t i = 0; i < std::min(kMost, names.size()); ++i) text += "  - " + names[i] + "\n";
  if (names.size() > kMost) text += "  - and " + std::to_string(names.size() - kMost) + " more (--json lists all)\n";
}

double normalTail(double z) { return std::erfc(z / std::sqrt(2.0)); }

}  // namespace

std::size_t RunComparison::regressions() const {
  return static_cast<std::size_t>(
      std::count_if(figures.begin(), figures.end(), [](const Comparison& c) { return c.regression; }));
}

std::size_t RunComparison::tested() const {
  return static_cast<std::size_t>(
      std::count_if(figures.begin(), figures.end(), [](const Comparison& c) { return c.tested; }));
}

double rankSumChance(const std::vector<double>& a, const std::vector<double>& b) {
  if (a.empty() || b.empty()) return 1;
  std::vector<double> all(a);
  all.insert(all.end(), b.begin(), b.end());
  std::sort(all.begin(), all.end());
  // Twice the mean rank, so that tied ranks are whole numbers.
  const auto rank2 = [&](double value) {
    const auto [lo, hi] = std::equal_range(all.begin(), all.end(), value);
    return static_cast<std::size_t>((lo - all.begin()) + (hi - all.begin()) + 1);
  };
  std::size_t sum = 0, total = 0;
  for (const double value : a) sum += rank2(value);
  for (const double value : all) total += rank2(value);
  const double mean = static_cast<double>(total) * static_cast<double>(a.size()) / static_cast<double>(all.size());
  const double off = std::abs(static_cast<double>(sum) - mean);
  if (all.size() > kMostExact) {
    double tied = 0;  // sum of t^3 - t over groups of t equal values
    for (auto from = all.begin(); from != all.end();) {
      const auto to = std::upper_bound(from, all.end(), *from);
      const auto t = static_cast<double>(to - from);
      tied += t * t * t - t;
      from = to;
    }
    const auto n = static_cast<double>(a.size()), m = static_cast<double>(b.size()), both = n + m;
    // The variance of twice the rank sum.
    const double variance = n * m / 3 * (both + 1 - tied / (both * (both - 1)));
    return variance <= 0 ? 1 : std::min(1.0, normalTail(std::max(0.0, off - 1) / std::sqrt(variance)));
  }
  // ways[k][s]: the number of choices of k values with rank sum s.
  std::vector<std::vector<double>> ways(a.size() + 1, std::vector<double>(total + 1, 0));
  ways[0][0] = 1;
  for (const double value : all) {
    const std::size_t rank = rank2(value);
    for (std::size_t k = a.size(); k-- > 0;)
      for (std::size_t s = total - rank + 1; s-- > 0;) ways[k + 1][s + rank] += ways[k][s];
  }
  double as_far = 0, choices = 0;
  for (std::size_t s = 0; s <= total; ++s) {
    choices += ways[a.size()][s];
    if (std::abs(static_cast<double>(s) - mean) >= off - 1e-9) as_far += ways[a.size()][s];
  }
  return as_far / choices;
}

std::vector<double> holmCorrected(const std::vector<double>& chances) {
  std::vector<std::size_t> order(chances.size());
  std::iota(order.begin(), order.end(), std::size_t{0});
  std::sort(order.begin(), order.end(), [&](std::size_t i, std::size_t j) { return chances[i] < chances[j]; });
  std::vector<double> corrected(chances.size());
  double least = 0;
  for (std::size_t i = 0; i < order.size(); ++i) {
    least = std::max(least, std::min(1.0, chances[order[i]] * static_cast<double>(order.size() - i)));
    corrected[order[i]] = least;
  }
  return corrected;
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
    const std::vector<Figure> figures_a = figuresOf(a), figures_b = figuresOf(b);
    compareFigures(figures_a, figures_b, comparison);
    noteTooFewBatches(figures_a, figures_b, comparison);
  } catch (const json::exception& error) {
    throw InputError(escaped(path_a) + " and " + escaped(path_b) +
                     ": not as bench.schema.json has it: " + error.what());
  }
  return comparison;
}

std::string comparisonMarkdown(const RunComparison& comparison) {
  BenchTable table{"comparison",
                   "Medians of two runs. Chance: of ranks so far apart if nothing changed; corrected: for all figures "
                   "tested (Holm)",
                   {"workload", "figure", "unit", "first", "second", "ratio", "chance", "corrected", ""},
                   {}};
  std::size_t untested = 0, shown_untested = 0;
  for (const Comparison& c : comparison.figures) {
    untested += !c.tested;
    if (!c.tested && !differsMuch(c)) continue;
    shown_untested += !c.tested;
    const BenchValue none = std::string("-");
    table.rows.push_back({c.workload, c.name, c.unit, c.a, c.b, c.ratio, c.tested ? BenchValue(c.chance) : none,
                          c.tested ? BenchValue(c.corrected) : none,
                          std::string(c.regression                 ? "**regression**"
                                      : !c.tested                  ? "not tested"
                                      : c.corrected < kSignificant ? "changed"
                                                                   : "")});
  }
  std::string text = markdownTable(table);
  text += '\n';
  for (const std::string& note : comparison.notes) text += "- " + note + "\n";
  listNames(comparison.only_a, "first", text);
  listNames(comparison.only_b, "second", text);
  if (untested > 0)
    text += "- " + std::to_string(untested) + " figures have one value a run and are not tested; " +
            std::to_string(shown_untested) + " of them differ by more than a factor of 2 and are shown\n";
  text += "- " + std::to_string(comparison.tested()) + " figures tested, " + std::to_string(comparison.regressions()) +
          " regressions: worse by more than 10 %, corrected chance below 0.05\n";
  return text;
}

std::string comparisonJson(const RunComparison& comparison) {
  nlohmann::ordered_json all{{"figures", json::array()},         {"only_first", comparison.only_a},
                             {"only_second", comparison.only_b}, {"notes", comparison.notes},
                             {"tested", comparison.tested()},    {"regressions", comparison.regressions()}};
  for (const Comparison& c : comparison.figures)
    all["figures"].push_back({{"workload", c.workload},
                              {"figure", c.name},
                              {"unit", c.unit},
                              {"first", c.a},
                              {"second", c.b},
                              {"ratio", c.ratio},
                              {"tested", c.tested},
                              {"chance", c.chance},
                              {"corrected", c.corrected},
                              {"regression", c.regression}});
  return all.dump(1, ' ', true) + "\n";
}

}  // namespace filiform::tools
