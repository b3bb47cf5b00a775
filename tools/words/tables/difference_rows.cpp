#include "tools/words/tables/difference_rows.h"

#include "index/text.h"
#include "tools/words/numbers.h"

#include <array>
#include <cmath>
#include <cstdio>

namespace filiform::tools {
namespace {

nlohmann::ordered_json numberOrNull(bool applies, double value) {
  return applies && !std::isnan(value) ? nlohmann::ordered_json(value) : nlohmann::ordered_json();
}

std::string roundedText(double value, const char* format = "%.1f") {
  std::array<char, 64> text{};
  std::snprintf(text.data(), text.size(), format, value);
  return text.data();
}

std::string percentOf(double part, double whole) { return whole > 0 ? roundedText(100 * part / whole) + " %" : "-"; }

std::string traceText(const CellDifference& cell, std::size_t i, double within_um) {
  const TraceDistance& d = (*cell.distance)[i];
  return "  " + escaped(cell.names[i], 80) + (i == 0 ? " (A): " : " (B): ") + roundedText(d.length_um) + " um, " +
         percentOf(d.within_length_um, d.length_um) + " of it within " + formatNumber(within_um) +
         " um of the other; distance: mean " + roundedText(d.mean_um, "%.3f") + ", median " +
         roundedText(d.median_um, "%.3f") + ", largest " + roundedText(d.max_um, "%.3f") + " um\n";
}

}  // namespace

nlohmann::ordered_json differenceJson(const CellDifference& cell, bool with_distances) {
  using Json = nlohmann::ordered_json;
  const CellFate fate = cell.change.kind;
  const bool changed = fate == CellFate::kChanged, moved = fate == CellFate::kMoved;
  const auto count = [&](std::uint64_t n) { return changed ? Json(n) : Json(); };
  const std::array<bool, 2> is_there{fate != CellFate::kAdded, fate != CellFate::kRemoved};
  Json json;
  for (std::size_t i = 0; i < 2; ++i) json[i == 0 ? "a" : "b"] = is_there[i] ? Json(cell.names[i]) : Json();
  json["state"] = name(fate);
  for (std::size_t i = 0; i < 2; ++i)
    json[i == 0 ? "samples_a" : "samples_b"] = is_there[i] ? Json(cell.samples[i]) : Json();
  for (std::size_t i = 0; i < 2; ++i)
    json[i == 0 ? "length_a_um" : "length_b_um"] = numberOrNull(is_there[i], cell.length_um[i]);
  json["samples_added"] = count(cell.change.samples_added);
  json["samples_removed"] = count(cell.change.samples_removed);
  json["samples_edited"] = count(cell.change.samples_edited);
  json["segments_added"] = count(cell.change.segments_added);
  json["segments_removed"] = count(cell.change.segments_removed);
  json["moved_um"] = numberOrNull(moved, cell.change.moved_um);
  json["turned_rad"] = numberOrNull(moved, cell.change.turned_rad);
  if (!with_distances) return json;
  const bool measured = cell.distance.has_value();
  for (std::size_t i = 0; i < 2; ++i) {
    const TraceDistance d = measured ? (*cell.distance)[i] : TraceDistance{};
    const auto put = [&](const std::string& field, double value) {
      json[field + (i == 0 ? "_a_um" : "_b_um")] = numberOrNull(measured, value);
    };
    put("within", d.within_length_um);
    put("mean", d.mean_um);
    put("median", d.median_um);
    put("max", d.max_um);
    put("step", d.step_um);
  }
  return json;
}

std::string differenceTitles(bool with_distances) {
  std::string line;
  const nlohmann::ordered_json json = differenceJson({}, with_distances);
  for (const auto& [title, value] : json.items()) (line += line.empty() ? "" : "\t") += title;
  return line + '\n';
}

std::string differenceRow(const CellDifference& cell, bool with_distances) {
  std::string line;
  const nlohmann::ordered_json json = differenceJson(cell, with_distances);
  for (const auto& [title, value] : json.items()) {
    if (!line.empty()) line += '\t';
    if (value.is_null())
      line += '-';
    else if (value.is_string())
      line += escaped(value.get<std::string>());
    else
      line += value.is_number_float() ? formatNumber(value.get<double>()) : value.dump();
  }
  return line + '\n';
}

std::string differenceText(const CellDifference& cell, double within_um) {
  const CellChange& change = cell.change;
  const std::size_t there = change.kind == CellFate::kAdded ? 1 : 0;
  std::string text = std::string(name(change.kind)) + ' ' + escaped(cell.names[there], 80);
  if (cell.names[1] != cell.names[there] && !cell.names[1].empty()) text += " and " + escaped(cell.names[1], 80);
  switch (change.kind) {
    case CellFate::kSame:
      break;
    case CellFate::kMoved:
      text += ": by " + roundedText(change.moved_um, "%.3f") + " um, turned by " +
              roundedText(change.turned_rad, "%.4f") + " rad";
      break;
    case CellFate::kChanged:
      text += ": samples +" + formatCount(change.samples_added) + " -" + formatCount(change.samples_removed) +
              ", edited " + formatCount(change.samples_edited) + "; segments +" + formatCount(change.segments_added) +
              " -" + formatCount(change.segments_removed) + "; length " + roundedText(cell.length_um[0]) + " to " +
              roundedText(cell.length_um[1]) + " um (" + roundedText(cell.length_um[1] - cell.length_um[0], "%+.1f") +
              ")";
      break;
    case CellFate::kAdded:
    case CellFate::kRemoved:
      text += ": " + counted(cell.samples[there], "sample") + ", " + roundedText(cell.length_um[there]) + " um";
      break;
  }
  text += '\n';
  if (cell.distance) text += traceText(cell, 0, within_um) + traceText(cell, 1, within_um);
  return text;
}

}  // namespace filiform::tools
