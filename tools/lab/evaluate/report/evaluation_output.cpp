#include "tools/lab/evaluate/report/evaluation_output.h"

#include "index/output.h"
#include "tools/program/interruption.h"
#include "tools/words/numbers.h"

#include <ostream>
#include <sstream>
#include <string>
#include <utility>
#include <variant>

#include <nlohmann/json.hpp>

namespace filiform::tools {

namespace {

using nlohmann::ordered_json;

void writeFile(const EvaluationResults& r, const std::string& name, const std::string& text) {
  Output file(r.options.out + "/" + name, {.cancel = &interruptFlag()});
  file.write(text);
  file.finish();
}

void writeHolds(std::ostream& out, const std::vector<HoldSeries>& holds) {
  out << "method,hand,stiffness_N_m,zoom_um,pull,oscillates,late_hop,energy_J\n";
  for (const HoldSeries& hold : holds)
    for (std::size_t i = 0; i < hold.results.size(); ++i)
      out << hold.method << ',' << hold.hand << ',' << formatNumber(hold.stiffness_N_m) << ','
          << formatNumber(hold.zoom_um) << ',' << i << ',' << hold.results[i].oscillates << ','
          << hold.results[i].late_hop << ',' << formatNumber(hold.results[i].energy_J) << '\n';
}

void writeCells(std::ostream& out, const std::vector<CorpusCell>& cells) {
  out << "cell,digest,held_out,samples,routes\n";
  for (const CorpusCell& cell : cells) {
    std::string source;
    for (const char c : cell.cell.source) source += c == '"' ? "\"\"" : std::string(1, c);
    std::ostringstream digest;
    digest << std::hex << cell.cell.digest;
    out << '"' << source << "\"," << digest.str() << ',' << cell.held_out << ',' << cell.cell.samples() << ','
        << cell.routes.size() << '\n';
  }
}

ordered_json jsonOf(const EvaluationResults& r, const std::vector<PageSection>& sections, double wall_s) {
  ordered_json json{{"seed", r.options.seed},         {"quick", r.options.quick},       {"wall_s", wall_s},
                    {"routes", r.corpus.routes},      {"cells", r.corpus.cells.size()}, {"methods", r.protocol.methods},
                    {"zooms_um", r.protocol.zooms_um}};
  for (const PageSection& section : sections) {
    for (const std::string& paragraph : section.paragraphs) json["notes"].push_back(paragraph);
    for (const PagePicture& one : section.pictures) json["pictures"].push_back(one.file);
    for (const BenchTable& table : section.tables) {
      ordered_json rows = ordered_json::array();
      for (const auto& row : table.rows) {
        ordered_json one;
        for (std::size_t i = 0; i < row.size(); ++i)
          one[table.columns[i]] = std::visit([](const auto& v) -> ordered_json { return v; }, row[i]);
        rows.push_back(std::move(one));
      }
      json["tables"][table.name] = {{"caption", table.caption}, {"rows", std::move(rows)}};
    }
  }
  return json;
}

}  // namespace

void writeEvaluationData(const EvaluationResults& r) {
  std::ostringstream trials, timings, holds, cells;
  writeTrialsHeader(trials);
  writeTrials(trials, r.scenes, r.scene_conditions, r.scene_trials);
  for (const FanFamily& family : r.fans) writeTrials(trials, family.fans, r.fan_conditions, family.trials);
  writeTrials(trials, r.corpus.cells, r.conditions, r.trials);
  writeTimingsHeader(timings);
  writeTimings(timings, r.scenes, r.scene_conditions, r.scene_trials);
  writeTimings(timings, r.corpus.cells, r.conditions, r.trials);
  writeHolds(holds, r.holds);
  writeCells(cells, r.corpus.cells);
  writeFile(r, "trials.csv", trials.str());
  writeFile(r, "timings.csv", timings.str());
  writeFile(r, "hold.csv", holds.str());
  writeFile(r, "cells.csv", cells.str());
}

void writeEvaluationReport(const EvaluationResults& r, const std::vector<PageSection>& sections, double wall_s) {
  const std::string title = "filiform evaluate";
  writeFile(r, "evaluate.json",
            jsonOf(r, sections, wall_s).dump(1, ' ', false, ordered_json::error_handler_t::replace) + "\n");
  writeFile(r, "evaluate.md", markdownPage(title, sections));
  writeFile(r, "evaluate.html", htmlPage(title, sections, r.options.out));
}

}  // namespace filiform::tools
