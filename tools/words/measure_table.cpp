#include "tools/words/measure_table.h"

#include "index/errors.h"
#include "index/measure/set_measures.h"
#include "index/text.h"
#include "tools/words/near_names.h"
#include "tools/words/numbers.h"

#include <array>
#include <cmath>
#include <utility>

namespace filiform::tools {
namespace {

using Value = MeasureTable::Value;

constexpr std::array<std::string_view, 5> kRowWords{"cell", "neurite", "branch", "type", "set"};  // by MeasureRows

// What stands between the commas; at least one text.
std::vector<std::string> wordsBetweenCommas(const std::string& list) {
  std::vector<std::string> parts;
  for (std::size_t begin = 0;;) {
    const std::size_t comma = list.find(',', begin);
    parts.push_back(list.substr(begin, comma - begin));
    if (comma == std::string::npos) return parts;
    begin = comma + 1;
  }
}

Value countValue(std::int64_t count) { return {.kind = Value::Kind::kCount, .count = count, .text = {}, .counts = {}}; }
Value textValue(std::string text) { return {.kind = Value::Kind::kText, .text = std::move(text), .counts = {}}; }

MeasurePer perOf(MeasureRows rows) {
  switch (rows) {
    case MeasureRows::kNeurite:
      return MeasurePer::kNeurite;
    case MeasureRows::kBranch:
      return MeasurePer::kBranch;
    case MeasureRows::kType:
      return MeasurePer::kType;
    case MeasureRows::kCell:
    case MeasureRows::kSet:
      break;
  }
  return MeasurePer::kCell;
}

}  // namespace

MeasureRows parseMeasureRows(const std::string& word, const std::string& option) {
  NearNames near(word);
  for (std::size_t i = 0; i < kRowWords.size(); ++i) {
    if (word == kRowWords[i]) return static_cast<MeasureRows>(i);
    near.offer(std::string(kRowWords[i]));
  }
  throw UsageError(option + " '" + escaped(word, 80) + "': give cell, neurite, branch, type or set" +
                   didYouMean(near.names()));
}

std::vector<const Feature*> parseFeatures(const std::string& names, const std::string& option) {
  std::vector<const Feature*> found;
  for (const std::string& name : wordsBetweenCommas(names)) {
    if (name == "all") {
      for (const Feature& feature : features()) found.push_back(&feature);
    } else if (const Feature* feature = findFeature(name)) {
      found.push_back(feature);
    } else {
      NearNames near(name);
      for (const Feature& known : features()) near.offer(std::string(known.name));
      throw UsageError(option + ": no feature has the name '" + escaped(name, 80) + "'" + didYouMean(near.names()) +
                       (near.names().empty() ? "; 'filiform measure --help' lists them" : ""));
    }
  }
  return found;
}

std::vector<std::uint16_t> parseNeuriteTypes(const std::string& names, const std::string& option) {
  std::vector<std::uint16_t> types;
  for (const std::string& name : wordsBetweenCommas(names)) {
    const std::optional<std::uint16_t> type = neuriteType(name);
    if (!type) {
      NearNames near(name);
      for (const std::string_view word : neuriteTypeNames()) near.offer(std::string(word));
      throw UsageError(option + " '" + escaped(name, 80) + "': give undefined, axon, basal, apical or a code of SWC" +
                       didYouMean(near.names()));
    }
    if (*type == kSomaType)
      throw UsageError(option + " '" + escaped(name, 80) +
                       "': a soma is no neurite; see the features soma_radius and " + "soma_area");
    types.push_back(*type);
  }
  return types;
}

MeasureTable::MeasureTable(const TileStore& store, MeasureChoice choice) : store_(store), choice_(std::move(choice)) {
  using Kind = Value::Kind;
  const MeasureRows rows = choice_.rows;
  if (rows == MeasureRows::kSet) {
    columns_ = {{"cells", Kind::kCount}};
  } else {
    columns_ = {{"id", Kind::kCount}, {"name", Kind::kText}};
  }
  if (rows == MeasureRows::kNeurite || rows == MeasureRows::kBranch) columns_.push_back({"neurite", Kind::kCount});
  if (rows == MeasureRows::kBranch) {
    columns_.push_back({"section", Kind::kCount});
    columns_.push_back({"parent", Kind::kCount});
  }
  if (rows == MeasureRows::kNeurite || rows == MeasureRows::kBranch) columns_.push_back({"sample", Kind::kCount});
  if (rows != MeasureRows::kCell && rows != MeasureRows::kSet) columns_.push_back({"type", Kind::kText});
  for (const Feature* feature : choice_.features)
    columns_.push_back({titleOf(*feature), feature->is_count ? Kind::kCount : Kind::kNumber});
  if (choice_.sholl_um > 0 && rows != MeasureRows::kBranch) {
    columns_.push_back({"sholl", Kind::kCounts});
    columns_.push_back({"sholl_by_ends", Kind::kCounts});
  }
}

MeasureTable::Row MeasureTable::rowOf(std::uint32_t cell, const MeasuredPart* part, const Measures& measures,
                                      const SomaShape* soma) const {
  Row row;
  if (choice_.rows == MeasureRows::kSet) {
    row.push_back(countValue(static_cast<std::int64_t>(measures.cells)));
  } else {
    row.push_back(countValue(cell));
    row.push_back(textValue(store_.cell(cell).name));
  }
  if (part != nullptr) {
    if (part->neurite != CellTree::kNone) row.push_back(countValue(part->neurite));
    if (part->section != CellTree::kNone) {
      row.push_back(countValue(part->section));
      row.push_back(countValue(part->parent == CellTree::kNone ? -1 : std::int64_t{part->parent}));
    }
    if (part->rank != CellTree::kNone) row.push_back(countValue(part->sample_id));
    row.push_back(textValue(neuriteTypeName(part->type)));
  }
  for (const Feature* feature : choice_.features) {
    const double number = feature->value(measures, soma);
    row.push_back({.kind = feature->is_count ? Value::Kind::kCount : Value::Kind::kNumber,
                   .count = std::isnan(number) ? 0 : static_cast<std::int64_t>(number),
                   .number = number,
                   .text = {},
                   .counts = {}});
  }
  if (choice_.sholl_um > 0 && choice_.rows != MeasureRows::kBranch)
    for (const auto* bins : {&measures.sholl, &measures.sholl_by_ends})
      row.push_back({.kind = Value::Kind::kCounts, .text = {}, .counts = *bins});
  return row;
}

void MeasureTable::measure(const std::vector<std::uint32_t>& cells, unsigned threads,
                           const std::function<void(std::size_t done)>& check,
                           const std::function<void(const Row&)>& row) const {
  std::size_t done = 0;
  Measures all;
  measureCells(store_, cells,
               {.measures = {.per = perOf(choice_.rows), .sholl_um = choice_.sholl_um, .types = choice_.types},
                .threads = threads,
                .memory_bytes = choice_.memory_bytes,
                .check = [&] { check(done); }},
               [&](std::uint32_t cell, const CellMeasures& measures) {
                 ++done;
                 if (choice_.rows == MeasureRows::kSet) {
                   all.add(measures.all);
                 } else if (choice_.rows == MeasureRows::kCell) {
                   row(rowOf(cell, nullptr, measures.all, &measures.soma));
                 } else {
                   for (const MeasuredPart& part : measures.parts) row(rowOf(cell, &part, part.measures, nullptr));
                 }
               });
  if (choice_.rows == MeasureRows::kSet) row(rowOf(0, nullptr, all, nullptr));
}

nlohmann::ordered_json measureJson(const Value& value) {
  switch (value.kind) {
    case Value::Kind::kText:
      return value.text;
    case Value::Kind::kCounts:
      return value.counts;
    case Value::Kind::kCount:
      if (!std::isnan(value.number)) return value.count;
      break;
    case Value::Kind::kNumber:
      if (std::isfinite(value.number)) return value.number;
      break;
  }
  return nullptr;
}

std::string measureText(const Value& value) {
  std::string text;
  switch (value.kind) {
    case Value::Kind::kText:
      return escaped(value.text);
    case Value::Kind::kCounts:
      for (const std::uint64_t count : value.counts) text += (text.empty() ? "" : ",") + std::to_string(count);
      break;
    case Value::Kind::kCount:
      if (!std::isnan(value.number)) text = std::to_string(value.count);
      break;
    case Value::Kind::kNumber:
      if (std::isfinite(value.number)) text = formatNumber(value.number);
      break;
  }
  return text.empty() ? "-" : text;
}

}  // namespace filiform::tools
