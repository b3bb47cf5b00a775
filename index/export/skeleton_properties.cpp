#include "index/export/skeleton_properties.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <utility>

#include <nlohmann/json.hpp>

namespace filiform {

namespace {

using PropertyJson = nlohmann::ordered_json;

constexpr std::uint32_t kMostTagTexts = 256;  // of one column
constexpr std::size_t kMostTags = 0xD000;     // of all columns: Neuroglancer holds their places as 16-bit characters

PropertyJson numberProperty(const std::string& id, const char* type, PropertyJson values) {
  return {{"id", id}, {"type", "number"}, {"data_type", type}, {"values", std::move(values)}};
}

// A tag holds no blank, because blanks separate the words of a query.
std::string tagOf(const std::string& column, const std::string& text) {
  std::string tag = column + "=" + text;
  for (char& c : tag)
    if (static_cast<unsigned char>(c) <= 0x20) c = '_';
  return tag;
}

// The columns of the attributes, one after the other.
class AttributeProperties {
 public:
  AttributeProperties(const std::vector<SkeletonCell>& cells, const CellAttributes& attributes)
      : cells_(cells), attributes_(attributes), places_(cells.size()) {}

  void add(std::uint32_t column, PropertyJson& properties) {
    const CellAttributes::Column& about = attributes_.columns()[column];
    if (about.type == AttributeType::text && about.entries <= kMostTagTexts && tags_.size() + about.entries < kMostTags)
      return addTags(column);
    if (about.type != AttributeType::text && addNumbers(column, properties)) return;
    PropertyJson texts = PropertyJson::array();
    for (const SkeletonCell& cell : cells_) texts.push_back(textOf(attributes_.value(column, cell.cell)));
    properties.push_back({{"id", about.name}, {"type", "string"}, {"values", std::move(texts)}});
  }

  // Neuroglancer wants the tags in order, and those of a cell too.
  void finish(PropertyJson& properties) const {
    if (tags_.empty()) return;
    std::vector<std::string> sorted = tags_;
    std::sort(sorted.begin(), sorted.end());
    sorted.erase(std::unique(sorted.begin(), sorted.end()), sorted.end());
    std::vector<std::size_t> place(tags_.size());
    for (std::size_t i = 0; i < tags_.size(); ++i)
      place[i] = static_cast<std::size_t>(std::lower_bound(sorted.begin(), sorted.end(), tags_[i]) - sorted.begin());
    PropertyJson values = PropertyJson::array();
    for (const std::vector<std::size_t>& of_cell : places_) {
      std::vector<std::size_t> these;
      for (const std::size_t tag : of_cell) these.push_back(place[tag]);
      std::sort(these.begin(), these.end());
      these.erase(std::unique(these.begin(), these.end()), these.end());
      values.push_back(these);
    }
    properties.push_back({{"id", "tags"}, {"type", "tags"}, {"tags", sorted}, {"values", std::move(values)}});
  }

 private:
  void addTags(std::uint32_t column) {
    const std::size_t first = tags_.size();
    for (const std::string& text : attributes_.dictionary(column))
      tags_.push_back(tagOf(attributes_.columns()[column].name, text));
    const std::vector<std::uint32_t> codes = attributes_.codes(column);
    for (std::size_t i = 0; i < cells_.size(); ++i)
      if (const std::uint32_t code = codes[cells_[i].cell]; code != CellAttributes::kNoCode)
        places_[i].push_back(first + code);
  }
  // False if a cell has no number, or an integer that only text holds with all its digits, such as an id.
  bool addNumbers(std::uint32_t column, PropertyJson& properties) const {
    const std::vector<double> numbers = attributes_.numbers(column);
    const bool integers = attributes_.columns()[column].type == AttributeType::integer;
    PropertyJson values = PropertyJson::array();
    for (const SkeletonCell& cell : cells_) {
      const double number = numbers[cell.cell];
      if (!std::isfinite(number)) return false;
      if (integers && std::abs(number) > INT32_MAX) return false;
      values.push_back(number);
    }
    if (integers)
      for (PropertyJson& value : values) value = static_cast<std::int64_t>(value.get<double>());
    properties.push_back(
        numberProperty(attributes_.columns()[column].name, integers ? "int32" : "float32", std::move(values)));
    return true;
  }

  const std::vector<SkeletonCell>& cells_;
  const CellAttributes& attributes_;
  std::vector<std::string> tags_;
  std::vector<std::vector<std::size_t>> places_;  // by cell: places in tags_
};

}  // namespace

std::string skeletonProperties(const TileStore& store, const std::vector<SkeletonCell>& cells,
                               const CellAttributes* attributes) {
  PropertyJson ids = PropertyJson::array(), names = PropertyJson::array(), sources = PropertyJson::array();
  constexpr std::array<std::pair<const char*, std::uint64_t CellRecord::*>, 3> kNumbers{
      {{"samples", &CellRecord::samples}, {"segments", &CellRecord::segments}, {"roots", &CellRecord::roots}}};
  std::array<PropertyJson, kNumbers.size()> numbers{PropertyJson::array(), PropertyJson::array(),
                                                    PropertyJson::array()};
  for (const SkeletonCell& cell : cells) {
    const CellRecord& record = store.cell(cell.cell);
    ids.push_back(std::to_string(cell.number));
    names.push_back(record.name);
    sources.push_back(record.source);
    // A number has 32 bits. A cell with more samples does not fit a skeleton either.
    for (std::size_t i = 0; i < kNumbers.size(); ++i)
      numbers[i].push_back(std::min<std::uint64_t>(record.*kNumbers[i].second, UINT32_MAX));
  }
  PropertyJson properties = PropertyJson::array();
  properties.push_back({{"id", "label"}, {"type", "label"}, {"values", std::move(names)}});
  properties.push_back({{"id", "source"}, {"type", "description"}, {"values", std::move(sources)}});
  for (std::size_t i = 0; i < kNumbers.size(); ++i)
    properties.push_back(numberProperty(kNumbers[i].first, "uint32", std::move(numbers[i])));
  if (attributes != nullptr) {
    AttributeProperties more(cells, *attributes);
    for (std::uint32_t column = 0; column < attributes->columns().size(); ++column) more.add(column, properties);
    more.finish(properties);
  }
  const PropertyJson json{{"@type", "neuroglancer_segment_properties"},
                          {"inline", {{"ids", std::move(ids)}, {"properties", std::move(properties)}}}};
  return json.dump(-1, ' ', true, PropertyJson::error_handler_t::replace) + "\n";
}

}  // namespace filiform
