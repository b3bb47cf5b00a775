#include "tools/words/contact_rows.h"

#include "index/errors.h"
#include "index/measure/cell_measures.h"
#include "index/text.h"
#include "tools/words/near_names.h"
#include "tools/words/npy.h"
#include "tools/words/numbers.h"

#include <algorithm>
#include <cmath>
#include <ostream>
#include <set>

namespace filiform::tools {

namespace {

constexpr std::array kSides{"from", "to"};

}  // namespace

std::string contactTitles() {
  std::string line = "from\tto\tdistance_um\tpairs";
  for (const char* side : kSides)
    for (const char* field : {"type", "sample", "x", "y", "z", "length_um", "path_um"})
      ((line += '\t') += side) += std::string("_") + field;
  return line + '\n';
}

void appendContactRow(std::string& rows, const TileStore& store, const ContactSite& site) {
  rows += escaped(store.cell(site.sides[0].cell).name);
  (rows += '\t') += escaped(store.cell(site.sides[1].cell).name);
  (rows += '\t') += formatNumber(site.distance_um);
  (rows += '\t') += std::to_string(site.pairs);
  for (const ContactSite::Side& side : site.sides) {
    (rows += '\t') += neuriteTypeName(side.type);
    (rows += '\t') += std::to_string(side.sample_id);
    for (int i = 0; i < 3; ++i) (rows += '\t') += formatNumber(side.p_W[i]);
    (rows += '\t') += formatNumber(side.length_um);
    (rows += '\t') += std::isnan(side.path_um) ? "-" : formatNumber(side.path_um);
  }
  rows += '\n';
}

nlohmann::ordered_json contactJson(const TileStore& store, const ContactSite& site) {
  nlohmann::ordered_json row;
  for (std::size_t i = 0; i < 2; ++i) row[kSides[i]] = escaped(store.cell(site.sides[i].cell).name);
  row["distance_um"] = site.distance_um;
  row["pairs"] = site.pairs;
  for (std::size_t i = 0; i < 2; ++i) {
    const ContactSite::Side& side = site.sides[i];
    const auto put = [&](const char* field, auto value) { row[std::string(kSides[i]) + "_" + field] = value; };
    put("type", neuriteTypeName(side.type));
    put("sample", side.sample_id);
    put("x", side.p_W.x()), put("y", side.p_W.y()), put("z", side.p_W.z());
    put("length_um", side.length_um);
    put("path_um", std::isnan(side.path_um) ? nlohmann::ordered_json() : nlohmann::ordered_json(side.path_um));
  }
  return row;
}

const std::vector<ContactArrays::Column>& ContactArrays::all() {
  static const std::vector<Column> kAll = [] {
    std::vector<Column> columns{{"distance_um", "'<f8'", 1}, {"pairs", "'<i8'", 1}};
    for (const char* side : kSides)
      for (const Column& field :
           {Column{"", "'<i4'", 1}, Column{"_type", "'<u2'", 1}, Column{"_sample", "'<i8'", 1},
            Column{"_xyz", "'<f8'", 3}, Column{"_length_um", "'<f8'", 1}, Column{"_path_um", "'<f8'", 1}})
        columns.push_back({side + field.title, field.type, field.width});
    return columns;
  }();
  return kAll;
}

void ContactArrays::add(const ContactSite& site) {
  values_.resize(all().size());
  std::size_t column = 0;
  const auto put = [&](auto value) { appendValue(values_[column++], value); };
  put(site.distance_um);
  put(static_cast<std::int64_t>(site.pairs));
  for (const ContactSite::Side& side : site.sides) {
    put(static_cast<std::int32_t>(side.cell));
    put(side.type);
    put(side.sample_id);
    for (int i = 0; i < 3; ++i) appendValue(values_[column], side.p_W[i]);
    ++column;
    put(side.length_um);
    put(side.path_um);
  }
  ++rows_;
}

std::uint64_t ContactArrays::bytes() const {
  std::uint64_t bytes = 0;
  for (const std::string& values : values_) bytes += values.capacity();
  return bytes;
}

std::size_t ContactArrays::columns() const { return all().size() + 1; }

std::string ContactArrays::title(std::size_t column) const {
  return column < all().size() ? all()[column].title : "cells";
}

std::string ContactArrays::npy(std::size_t column) const {
  if (column < all().size()) {
    const Column& c = all()[column];
    return npyHeader(c.type, rows_, c.width > 1 ? std::optional(c.width) : std::nullopt) +
           (values_.empty() ? std::string() : values_[column]);
  }
  return npyOfTexts(store_.cell_count(), [&](std::size_t cell) -> std::string_view {
    return store_.cell(static_cast<std::uint32_t>(cell)).name;
  });
}

ContactMatrix::Axis ContactMatrix::axisOf(const CellAttributes& attributes, std::uint32_t column,
                                          const std::vector<std::uint32_t>& cells) {
  // Numbers ascend as numbers, texts as bytes; cells without a value come last.
  const auto before = [](const AttributeValue& a, const AttributeValue& b) {
    if (isMissing(a) || isMissing(b)) return isMissing(b) && !isMissing(a);
    return a < b;
  };
  std::map<AttributeValue, std::vector<std::uint32_t>, decltype(before)> cells_of(before);
  for (const std::uint32_t cell : cells) {
    cells_of[attributes.value(column, cell)].push_back(cell);
    if (cells_of.size() > kMostValues)
      throw UsageError("--matrix " + inShort(attributes.columns()[column].name) + ": the attribute has more than " +
                       formatCount(kMostValues) + " different values; choose one that groups cells");
  }
  Axis axis;
  for (const auto& [value, of_value] : cells_of) {
    for (const std::uint32_t cell : of_value) axis.place_of[cell] = static_cast<std::uint32_t>(axis.values.size());
    axis.values.push_back(isMissing(value) ? "-" : escaped(textOf(value)));
  }
  return axis;
}

ContactMatrix::ContactMatrix(const CellAttributes& attributes, std::uint32_t column,
                             const std::vector<std::uint32_t>& from, const std::vector<std::uint32_t>& to,
                             bool both_ways)
    : axes_{axisOf(attributes, column, from), axisOf(attributes, column, to)},
      both_ways_(both_ways),
      title_(escaped(attributes.columns()[column].name)),
      counts_(axes_[0].values.size() * axes_[1].values.size()) {}

std::uint64_t& ContactMatrix::at(std::uint32_t from, std::uint32_t to) {
  return counts_[std::size_t{from} * axes_[1].values.size() + to];
}

void ContactMatrix::add(const ContactSite& site) {
  const std::uint32_t from = axes_[0].place_of.at(site.sides[0].cell), to = axes_[1].place_of.at(site.sides[1].cell);
  ++at(from, to);
  if (both_ways_ && from != to) ++at(to, from);
}

void ContactMatrix::write(std::ostream& out) const {
  out << title_;
  for (const std::string& value : axes_[1].values) out << '\t' << value;
  out << '\n';
  std::size_t place = 0;
  for (const std::string& value : axes_[0].values) {
    out << value;
    for (std::size_t i = 0; i < axes_[1].values.size(); ++i) out << '\t' << counts_[place++];
    out << '\n';
  }
}

}  // namespace filiform::tools
