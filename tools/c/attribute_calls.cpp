// filiform.h: attributes and measures of cells, filters, counts, levels of detail.
#include "index/errors.h"
#include "index/levels/level_rows.h"
#include "index/text.h"
#include "tools/c/open_set.h"
#include "tools/words/filter_words.h"
#include "tools/words/measure_table.h"

#include <algorithm>
#include <iterator>
#include <optional>
#include <string>
#include <utility>

namespace filiform::c {

namespace {

std::vector<std::string> textsOf(const char* const* texts, std::size_t count, const char* name) {
  std::vector<std::string> all;
  if (count > 0) required(texts, name);
  for (std::size_t i = 0; i < count; ++i) all.emplace_back(required(texts[i], name));
  return all;
}

std::vector<std::uint32_t> cellsMeeting(SetFiles& files, const std::vector<std::string>& where) {
  return tools::CellConditions(where).select(*files.set, *files.set, files.attributes(), 1,
                                             [](const auto&, std::size_t) {});
}

std::vector<std::uint32_t> cellsOf(const OpenSet& scene, const std::uint32_t* cells, std::size_t count) {
  std::vector<std::uint32_t> ids;
  if (cells != nullptr) {
    for (std::size_t i = 0; i < count; ++i) {
      scene.requireCell(cells[i]);
      if (scene.set->cell(cells[i]).removed) throw UsageError("cell " + std::to_string(cells[i]) + ": was removed");
      ids.push_back(cells[i]);
    }
    return ids;
  }
  for (std::uint32_t id = 0; id < scene.set->cell_count(); ++id)
    if (!scene.set->cell(id).removed) ids.push_back(id);
  return ids;
}

// The values of both; nothing stands for all values.
template <typename Value>
std::optional<std::vector<Value>> inBoth(std::optional<std::vector<Value>> a, std::optional<std::vector<Value>> b) {
  if (!a || !b) return a ? a : b;
  for (auto* list : {&*a, &*b}) std::sort(list->begin(), list->end());
  std::vector<Value> both;
  std::set_intersection(a->begin(), a->end(), b->begin(), b->end(), std::back_inserter(both));
  both.erase(std::unique(both.begin(), both.end()), both.end());
  return both;
}

Vector3d cornerFrom(const double values[3], const char* name) {
  required(values, name);
  return {values[0], values[1], values[2]};
}

}  // namespace

const Levels* SetFiles::levels() {
  const std::lock_guard lock(mutex_);
  if (!levels_) levels_ = Levels::open(*set);
  return levels_->get();
}

const CellAttributes& SetFiles::attributes() {
  const std::lock_guard lock(mutex_);
  if (!attributes_) attributes_.emplace(*set);
  return *attributes_;
}

std::uint32_t SetFiles::column(const std::string& name) {
  const std::optional<std::uint32_t> found = attributes().find(name);
  if (!found) throw UsageError("name: no cell has an attribute '" + escaped(name, 80) + "'");
  return *found;
}

std::vector<const char*> SetFiles::texts(const std::string& name) {
  const std::uint32_t at = column(name);
  const CellAttributes& columns = attributes();
  std::vector<const char*> all(set->cell_count(), nullptr);
  const std::lock_guard lock(mutex_);
  std::set<std::string>& kept_texts = texts_[at];
  for (std::uint32_t cell = 0; cell < all.size(); ++cell) {
    const AttributeValue value = columns.value(at, cell);
    if (isMissing(value)) continue;
    all[cell] = kept_texts.insert(textOf(value)).first->c_str();
  }
  return all;
}

}  // namespace filiform::c

using namespace filiform;
using namespace filiform::c;

static_assert(FILIFORM_TEXT == static_cast<int>(AttributeType::text) &&
              FILIFORM_INTEGER == static_cast<int>(AttributeType::integer) &&
              FILIFORM_REAL == static_cast<int>(AttributeType::real));

extern "C" {

int filiform_attributes(filiform_set* set, filiform_attribute** attributes, size_t* count) {
  return call([&] {
    *required(attributes, "attributes") = nullptr;
    *required(count, "count") = 0;
    const HeldSet held(set, "set");
    std::vector<filiform_attribute> all;
    for (const CellAttributes::Column& column : (*held)->files->attributes().columns())
      all.push_back({column.name.c_str(), static_cast<std::uint32_t>(column.type), 0, column.values});
    *attributes = arrayOf(all);
    *count = all.size();
  });
}

int filiform_attribute_numbers(filiform_set* set, const char* name, double* values) {
  return call([&] {
    const HeldSet held(set, "set");
    const CellAttributes& attributes = (*held)->files->attributes();
    const std::uint32_t column = (*held)->files->column(required(name, "name"));
    required(values, "values");
    if (attributes.columns()[column].type == AttributeType::text)
      throw UsageError(std::string(name) + ": has texts; use filiform_attribute_texts()");
    const std::vector<double> numbers = attributes.numbers(column);
    std::copy(numbers.begin(), numbers.end(), values);
  });
}

int filiform_attribute_texts(filiform_set* set, const char* name, const char*** texts, size_t* count) {
  return call([&] {
    *required(texts, "texts") = nullptr;
    *required(count, "count") = 0;
    const HeldSet held(set, "set");
    const std::vector<const char*> all = (*held)->files->texts(required(name, "name"));
    *texts = arrayOf(all);
    *count = all.size();
  });
}

int filiform_where(filiform_set* set, const char* const* conditions, size_t condition_count, uint32_t** cells,
                   size_t* count) {
  return call([&] {
    *required(cells, "cells") = nullptr;
    *required(count, "count") = 0;
    const HeldSet held(set, "set");
    const std::vector<std::uint32_t> met =
        cellsMeeting(*(*held)->files, textsOf(conditions, condition_count, "conditions"));
    *cells = arrayOf(met);
    *count = met.size();
  });
}

int filiform_measure(filiform_set* set, const uint32_t* cells, size_t cell_count, const char* features, double** values,
                     size_t* rows, size_t* columns) {
  return call([&] {
    *required(values, "values") = nullptr;
    *required(rows, "rows") = 0;
    *required(columns, "columns") = 0;
    const HeldSet held(set, "set");
    const std::vector<const Feature*> wanted = tools::parseFeatures(required(features, "features"), "features");
    const std::vector<std::uint32_t> ids = cellsOf(**held, cells, cell_count);
    std::vector<std::uint32_t> measured = ids;
    std::sort(measured.begin(), measured.end());
    measured.erase(std::unique(measured.begin(), measured.end()), measured.end());
    const std::vector<std::vector<double>> by_feature =
        tools::measureValues(*(*held)->set, measured, wanted, 1, [](const auto&, std::size_t) {});
    std::vector<double> table;
    table.reserve(ids.size() * wanted.size());
    for (const std::uint32_t id : ids) {
      const auto at = std::lower_bound(measured.begin(), measured.end(), id) - measured.begin();
      for (const std::vector<double>& column : by_feature) table.push_back(column[static_cast<std::size_t>(at)]);
    }
    *values = arrayOf(table);
    *rows = ids.size();
    *columns = wanted.size();
  });
}

int filiform_open_filtered(filiform_set* set, const filiform_filter* filter, filiform_set** filtered) {
  return call([&] {
    *required(filtered, "filtered") = nullptr;
    const HeldSet held(set, "set");
    const filiform_filter asked = *sized(filter, "filter");
    NearestOptions search = (*held)->search;
    std::optional<std::vector<std::uint16_t>> types;
    if (asked.types != nullptr) types.emplace(asked.types, asked.types + asked.type_count);
    if (!search.filter.types.empty()) types = inBoth(std::move(types), std::optional(search.filter.types));
    const std::vector<std::string> where =
        textsOf(asked.where, asked.where == nullptr ? 0 : asked.where_count, "where");
    std::optional<std::vector<std::uint32_t>> cells = search.filter.cells;
    if (!where.empty()) cells = inBoth(std::move(cells), std::optional(cellsMeeting(*(*held)->files, where)));
    if (asked.cells != nullptr) {
      std::vector<std::uint32_t> ids = cellsOf(**held, asked.cells, asked.cell_count);
      std::sort(ids.begin(), ids.end());
      ids.erase(std::unique(ids.begin(), ids.end()), ids.end());
      cells = inBoth(std::move(cells), std::optional(std::move(ids)));
    }
    if (types && types->empty()) cells.emplace();  // an empty list of types would be all types
    search.filter = {std::move(cells), std::move(types).value_or(std::vector<std::uint16_t>())};
    auto opened = std::make_shared<SetHandle>(std::make_shared<OpenSet>((*held)->files, search));
    *filtered = static_cast<filiform_set*>(HandleTable::ofProcess().add(HandleKind::set, std::move(opened)));
  });
}

int filiform_box_counts(filiform_set* set, const double lo_um[3], const double hi_um[3], int by_middle,
                        filiform_cell_count** counts, size_t* count) {
  return call([&] {
    *required(counts, "counts") = nullptr;
    *required(count, "count") = 0;
    const HeldSet held(set, "set");
    std::vector<filiform_cell_count> all;
    for (const auto& [cell, segments] :
         (*held)->nearest.countInBox(cornerFrom(lo_um, "lo_um"), cornerFrom(hi_um, "hi_um"), by_middle != 0))
      all.push_back({cell, 0, segments});
    *counts = arrayOf(all);
    *count = all.size();
  });
}

int filiform_levels(filiform_set* set, const double lo_um[3], const double hi_um[3], double pixels, uint64_t most,
                    filiform_level_segment** segments, size_t* count, double* error_um) {
  return call([&] {
    *required(segments, "segments") = nullptr;
    *required(count, "count") = 0;
    if (error_um != nullptr) *error_um = 0;
    const HeldSet held(set, "set");
    LevelBox box{.lo_W = cornerFrom(lo_um, "lo_um"), .hi_W = cornerFrom(hi_um, "hi_um"), .pixels = pixels};
    if (most != 0) box.most_segments = most;
    if (!box.lo_W.allFinite() || !box.hi_W.allFinite()) throw UsageError("lo_um, hi_um: must be finite");
    const Levels* const levels = (*held)->files->levels();
    if (levels == nullptr) throw InputError("the set has no levels of detail; make it without no_levels");
    const LevelRows found = levelRows(*(*held)->set, *levels, box);
    std::vector<filiform_level_segment> all;
    all.reserve(found.rows.size());
    for (const LevelRow& row : found.rows) {
      filiform_level_segment& told = all.emplace_back();
      std::copy_n(row.child_W.data(), 3, told.child_um);
      std::copy_n(row.parent_W.data(), 3, told.parent_um);
      told.radius_um = row.radius_um;
      told.type = row.type;
      told.cell = row.cell;
    }
    *segments = arrayOf(all);
    *count = all.size();
    if (error_um != nullptr) *error_um = found.error_um;
  });
}

}  // extern "C"
