#include "tools/lab/bench/bench_record.h"

#include "index/output.h"
#include "tools/lab/bench/peers.h"
#include "tools/lab/shared/page.h"
#include "tools/words/numbers.h"

#include <algorithm>
#include <chrono>
#include <sstream>
#include <stdexcept>

#include <nlohmann/json.hpp>

namespace filiform::tools {

namespace {

using nlohmann::ordered_json;

ordered_json valueJson(const BenchValue& value) {
  return std::visit([](const auto& v) -> ordered_json { return v; }, value);
}

ordered_json machine() {
  ordered_json json;
  for (const auto& [name, value] : machineFacts()) json[name] = valueJson(value);
#ifdef NDEBUG
  json["assertions"] = false;
#else
  json["assertions"] = true;
#endif
  const BuildFacts facts = buildFacts();
  json["commit"] = facts.commit;
  json["flags"] = facts.flags;
  return json;
}

ordered_json libraries() {
  ordered_json json;
  for (const auto& [name, version] : libraryVersions()) json[name] = version;
  return json;
}

std::vector<std::string> keysOf(const BenchTable& table) {
  std::vector<std::string> keys = table.keys;
  if (keys.empty()) keys.push_back(table.columns.at(0));
  for (const std::string& key : keys)
    if (std::find(table.columns.begin(), table.columns.end(), key) == table.columns.end())
      throw std::logic_error("bench table " + table.name + ": no column is called " + key);
  return keys;
}

ordered_json rowJson(const std::vector<BenchValue>& row) {
  ordered_json values = ordered_json::array();
  for (const BenchValue& value : row) values.push_back(valueJson(value));
  return values;
}

ordered_json curveJson(const BenchCurve& curve) {
  const Plot& plot = curve.plot;
  ordered_json json{{"title", plot.title},
                    {"x", plot.x_label},
                    {"y", plot.y_label},
                    {"x_log", plot.x_log},
                    {"y_log", plot.y_log},
                    {"finding", curve.finding},
                    {"marks", ordered_json::array()},
                    {"series", ordered_json::array()}};
  for (const PlotLine& line : plot.lines) json["marks"].push_back({{"x", line.x}, {"label", line.label}});
  for (const PlotSeries& series : plot.series)
    json["series"].push_back({{"name", series.name}, {"x", series.x}, {"y", series.y}});
  return json;
}

ordered_json resultJson(const BenchResult& result, const BenchOptions& options) {
  const BenchReport& report = result.report;
  ordered_json json{{"workload", result.name}, {"summary", result.summary}, {"seed", options.seed},
                    {"quick", options.quick},  {"wall_s", result.wall_s},   {"machine", machine()}};
  for (const auto& [name, version] : report.versions) json["versions"][name] = version;
  for (const BenchGoal& goal : report.goals)
    json["goals"].push_back({{"what", goal.what},
                             {"must", goal.must},
                             {"aim", goal.aim},
                             {"measured", goal.measured},
                             {"met_must", goal.met_must},
                             {"met_aim", goal.met_aim}});
  for (const BenchTable& table : report.tables) {
    ordered_json rows = ordered_json::array();
    for (const auto& row : table.rows) {
      if (row.size() != table.columns.size())
        throw std::logic_error("bench table " + table.name + ": a row of another length than the columns");
      ordered_json one;
      for (std::size_t i = 0; i < row.size(); ++i) one[table.columns[i]] = valueJson(row[i]);
      rows.push_back(std::move(one));
    }
    if (json.contains("tables") && json["tables"].contains(table.name))
      throw std::logic_error("bench: two tables are called " + table.name);
    json["tables"][table.name] = {{"caption", table.caption}, {"rows", std::move(rows)}, {"keys", keysOf(table)}};
  }
  json["notes"] = report.notes;
  json["pictures"] = report.pictures;
  for (const BenchBound& bound : report.bounds)
    json["bounds"].push_back({{"what", bound.what},
                              {"stated", bound.stated},
                              {"bound", bound.bound},
                              {"measured", bound.measured},
                              {"unit", bound.unit},
                              {"holds", bound.holds()}});
  for (const BenchSample& sample : report.samples)
    json["samples"].push_back({{"name", sample.name()},
                               {"unit", sample.unit},
                               {"more_is_better", sample.more_is_better},
                               {"batches", sample.batches},
                               {"table", sample.table},
                               {"row", rowJson(sample.row)},
                               {"column", sample.column}});
  for (const BenchCurve& curve : report.curves) json["curves"][curve.name] = curveJson(curve);
  return json;
}

BenchTable goalTable(const std::vector<BenchGoal>& goals) {
  BenchTable table{"goals", "What was promised", {"what", "must", "aim", "measured", "met"}, {}};
  for (const BenchGoal& goal : goals)
    table.rows.push_back({goal.what, goal.must, goal.aim, goal.measured,
                          std::string(goal.met_aim    ? "aim"
                                      : goal.met_must ? "must"
                                                      : "missed")});
  return table;
}

BenchTable boundTable(const std::vector<BenchBound>& bounds) {
  BenchTable table{
      "bounds", "Bounds of approximate modes", {"what", "stated", "bound", "measured", "unit", "holds"}, {}};
  for (const BenchBound& bound : bounds)
    table.rows.push_back({bound.what, bound.stated, bound.bound, bound.measured, bound.unit,
                          std::string(bound.holds() ? "holds" : "missed")});
  return table;
}

// Describes a plot for readers who cannot see it.
std::string described(const BenchCurve& curve) {
  std::string text =
      curve.plot.title + ": " + curve.plot.y_label + " against " + curve.plot.x_label + ". " + curve.finding;
  for (const PlotLine& line : curve.plot.lines) text += " Line at " + shown(line.x) + ": " + line.label + ".";
  for (const PlotSeries& series : curve.plot.series) {
    if (series.x.empty()) continue;
    text += " " + series.name + ": " + shown(series.y.front()) + " at " + shown(series.x.front()) + ", " +
            shown(series.y.back()) + " at " + shown(series.x.back()) + ".";
  }
  return text;
}

std::string ranOn(const BenchOptions& options, double wall_s) {
  std::ostringstream out;
  const ordered_json where = machine();
  out << shown(wall_s) << " s on " << where["processor"].get<std::string>() << ", " << where["threads"] << " threads, "
      << where["compiler"].get<std::string>() << (where["assertions"].get<bool>() ? ", assertions on" : "")
      << ", commit " << where["commit"].get<std::string>() << ", seed " << options.seed;
  return out.str();
}

std::string quoted(const std::string& text) {
  std::string out = "\"";
  for (const char c : text) out += c == '"' ? std::string("\"\"") : std::string(1, c);
  return out + "\"";
}

std::string csv(const std::vector<BenchResult>& results) {
  std::ostringstream out;
  out << "workload,kind,name,row,column,value\n";
  const auto line = [&](const BenchResult& result, const char* kind, const std::string& name, std::size_t row,
                        const std::string& column, const BenchValue& value) {
    out << result.name << ',' << kind << ',' << quoted(name) << ',' << row << ',' << quoted(column) << ',';
    if (const auto* text = std::get_if<std::string>(&value))
      out << quoted(*text);
    else if (const auto* count = std::get_if<std::int64_t>(&value))
      out << *count;
    else
      out << formatNumber(std::get<double>(value));
    out << '\n';
  };
  for (const BenchResult& result : results) {
    const BenchReport& report = result.report;
    std::vector<BenchTable> tables = report.tables;
    if (!report.goals.empty()) tables.push_back(goalTable(report.goals));
    if (!report.bounds.empty()) tables.push_back(boundTable(report.bounds));
    for (const BenchTable& table : tables)
      for (std::size_t r = 0; r < table.rows.size(); ++r)
        for (std::size_t c = 0; c < table.columns.size(); ++c)
          line(result, "table", table.name, r, table.columns[c], table.rows[r][c]);
    for (const BenchSample& sample : report.samples)
      for (std::size_t i = 0; i < sample.batches.size(); ++i)
        line(result, "sample", sample.name(), i, sample.unit, sample.batches[i]);
    for (const BenchCurve& curve : report.curves)
      for (const PlotSeries& series : curve.plot.series)
        for (std::size_t i = 0; i < series.x.size(); ++i) {
          line(result, "curve", curve.name + "/" + series.name, i, curve.plot.x_label, series.x[i]);
          line(result, "curve", curve.name + "/" + series.name, i, curve.plot.y_label, series.y[i]);
        }
  }
  return out.str();
}

std::vector<PageSection> sections(const std::vector<BenchResult>& results, const BenchOptions& options, double wall_s,
                                  double load_before) {
  std::vector<PageSection> all;
  PageSection first{"Summary", {}, {}, {}};
  first.paragraphs.push_back("Measured in " + ranOn(options, wall_s) +
                             "; load of the machine before: " + shown(load_before) + ".");
  if (options.quick) first.paragraphs.push_back("Quick run: these figures mean nothing.");
  BenchTable facts{"machine", "The machine and the build", {"what", "value"}, {}};
  const ordered_json where = machine();
  for (const auto& [name, value] : where.items())
    facts.rows.push_back({name, value.is_string() ? value.get<std::string>() : value.dump()});
  for (const auto& [name, version] : libraryVersions()) facts.rows.push_back({name, version});
  for (const Peer& peer : peers())
    facts.rows.push_back({"peer " + peer.name, peer.inBuild() ? peer.version : std::string("not in this build")});
  std::vector<BenchGoal> goals;
  std::vector<BenchBound> bounds;
  BenchTable found{"findings", "What the curves decided", {"workload", "curve", "finding"}, {}};
  for (const BenchResult& result : results) {
    for (BenchGoal goal : result.report.goals) {
      goal.what = result.name + ": " + goal.what;
      goals.push_back(std::move(goal));
    }
    bounds.insert(bounds.end(), result.report.bounds.begin(), result.report.bounds.end());
    for (const BenchCurve& curve : result.report.curves)
      found.rows.push_back({result.name, curve.plot.title, curve.finding});
  }
  if (!goals.empty()) first.tables.push_back(goalTable(goals));
  if (!bounds.empty()) first.tables.push_back(boundTable(bounds));
  if (!found.rows.empty()) first.tables.push_back(std::move(found));
  first.tables.push_back(std::move(facts));
  all.push_back(std::move(first));
  for (const BenchResult& result : results) {
    PageSection section{result.name, {result.summary + " (" + shown(result.wall_s) + " s)"}, {}, {}};
    for (const BenchCurve& curve : result.report.curves)
      section.figures.push_back({svgPlot(curve.plot), described(curve), curve.finding});
    section.tables = result.report.tables;
    for (const std::string& picture : result.report.pictures)
      section.pictures.push_back({picture, result.name + ": " + picture});
    section.paragraphs.insert(section.paragraphs.end(), result.report.notes.begin(), result.report.notes.end());
    all.push_back(std::move(section));
  }
  return all;
}

}  // namespace

void writeText(const std::string& path, const std::string& text) {
  Output file(path);
  file.write(text);
  file.finish();
}

std::string workloadJson(const BenchResult& result, const BenchOptions& options) {
  return resultJson(result, options).dump(1) + "\n";
}

std::string workloadMarkdown(const BenchResult& result, const BenchOptions& options) {
  const BenchReport& report = result.report;
  std::ostringstream out;
  out << "# bench " << result.name << ": " << result.summary << "\n\n"
      << "`filiform bench " << result.name << " --seed " << options.seed << (options.quick ? " --quick" : "") << "`, "
      << ranOn(options, result.wall_s);
  for (const auto& [name, version] : report.versions) out << ", " << name << ' ' << version;
  out << ".\n";
  if (options.quick) out << "\n**Quick run: these figures mean nothing.**\n";
  if (!report.goals.empty()) {
    out << "\n| what | must | aim | measured | |\n|---|---|---|---|---|\n";
    for (const BenchGoal& goal : report.goals)
      out << "| " << goal.what << " | " << goal.must << " | " << goal.aim << " | " << shown(goal.measured) << " | "
          << (goal.met_aim    ? "aim"
              : goal.met_must ? "must"
                              : "**missed**")
          << " |\n";
  }
  if (!report.bounds.empty()) out << '\n' << markdownTable(boundTable(report.bounds));
  for (const BenchCurve& curve : report.curves) out << "\n**" << curve.plot.title << ".** " << curve.finding << '\n';
  for (const BenchTable& table : report.tables) out << "\n" << markdownTable(table);
  for (const std::string& picture : report.pictures) out << "\n![" << picture << "](" << picture << ")\n";
  if (!report.notes.empty()) out << '\n';
  for (const std::string& note : report.notes) out << "- " << note << '\n';
  return out.str();
}

std::string benchRunJson(const std::vector<BenchResult>& results, const BenchOptions& options, double wall_s,
                         double load_before) {
  ordered_json json{{"format", "filiform-bench-1"},
                    {"seed", options.seed},
                    {"quick", options.quick},
                    {"long", options.long_run},
                    {"size", options.segments},
                    {"corpus", !options.corpus.empty()},
                    {"wall_s", wall_s},
                    {"load_before", load_before},
                    {"machine", machine()},
                    {"libraries", libraries()},
                    {"workloads", ordered_json::array()}};
  for (const Peer& peer : peers())
    json["peers"][peer.name] = peer.inBuild() ? ordered_json(peer.version) : ordered_json();
  for (const BenchResult& result : results) json["workloads"].push_back(resultJson(result, options));
  return json.dump(1) + "\n";
}

void writeBenchRun(const std::vector<BenchResult>& results, const BenchOptions& options, double wall_s,
                   double load_before) {
  writeText(options.out + "/bench.json", benchRunJson(results, options, wall_s, load_before));
  writeText(options.out + "/bench.csv", csv(results));
  const std::vector<PageSection> all = sections(results, options, wall_s, load_before);
  const std::string title = "filiform bench";
  writeText(options.out + "/bench.html", htmlPage(title, all, options.out));
  writeText(options.out + "/bench.md", markdownPage(title, all));
}

BenchResult runWorkload(const Workload& workload, const BenchOptions& options) {
  const auto started = std::chrono::steady_clock::now();
  BenchResult result{workload.name, workload.summary, 0, workload.run(options)};
  result.wall_s = std::chrono::duration<double>(std::chrono::steady_clock::now() - started).count();
  const std::string base = options.out + "/" + workload.name;
  writeText(base + ".json", workloadJson(result, options));
  writeText(base + ".md", workloadMarkdown(result, options));
  return result;
}

}  // namespace filiform::tools
