#include "index/export/skeleton_properties.h"

#include "index/formats/neuroglancer/internal/segment_properties.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numeric>
#include <set>
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

// This id, with `_` behind it while an attribute has it.
std::string unusedId(std::string id, const CellAttributes& attributes) {
  while (attributes.find(id)) id += '_';
  return id;
}

// A tag holds no blank, because blanks separate the words of a query.
std::string tagOf(std::string tag) {
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
    if (about.type == AttributeType::text && addTags(column)) return;
    if (about.type != AttributeType::text && addNumbers(column, properties)) return;
    PropertyJson texts = PropertyJson::array();
    for (const SkeletonCell& cell : cells_) texts.push_back(textOf(attributes_.value(column, cell.cell)));
    PropertyJson property{{"id", about.name}, {"type", "string"}};
    if (about.type != AttributeType::text) property["description"] = name(about.type);  // for SegmentProperties
    property["values"] = std::move(texts);
    properties.push_back(std::move(property));
  }

  // Neuroglancer wants the tags in order, and those of a cell too.
  void finish(PropertyJson& properties) const {
    if (tags_.empty()) return;
    std::vector<std::size_t> order(tags_.size()), place(tags_.size());
    std::iota(order.begin(), order.end(), std::size_t{0});
    std::sort(order.begin(), order.end(), [&](std::size_t a, std::size_t b) { return tags_[a].tag < tags_[b].tag; });
    PropertyJson tags = PropertyJson::array(), descriptions = PropertyJson::array();
    for (std::size_t i = 0; i < order.size(); ++i) {
      place[order[i]] = i;
      tags.push_back(tags_[order[i]].tag);
      descriptions.push_back(tags_[order[i]].text);
    }
    PropertyJson values = PropertyJson::array();
    for (const std::vector<std::size_t>& of_cell : places_) {
      std::vector<std::size_t> these;
      for (const std::size_t tag : of_cell) these.push_back(place[tag]);
      std::sort(these.begin(), these.end());
      values.push_back(these);
    }
    PropertyJson property{{"id", unusedId("tags", attributes_)}, {"type", "tags"}, {"tags", tags}};
    if (tags != descriptions) property["tag_descriptions"] = std::move(descriptions);
    property["values"] = std::move(values);
    properties.push_back(std::move(property));
  }

 private:
  struct Tag {
    std::string tag, text;  // text: with its blanks
  };

  // False if the column has too many texts, or tags from which its texts do not follow.
  bool addTags(std::uint32_t column) {
    const CellAttributes::Column& about = attributes_.columns()[column];
    if (about.entries > kMostTagTexts || tags_.size() + about.entries >= kMostTags ||
        about.name.find('=') != std::string::npos)
      return false;
    const std::size_t first = tags_.size();
    std::set<std::string> different = all_tags_;
    for (const std::string& text : attributes_.dictionary(column)) {
      const std::string whole = about.name + "=" + text;
      if (!different.insert(tagOf(whole)).second) {
        tags_.resize(first);
        return false;
      }
      tags_.push_back({tagOf(whole), whole});
    }
    all_tags_ = std::move(different);
    const std::vector<std::uint32_t> codes = attributes_.codes(column);
    for (std::size_t i = 0; i < cells_.size(); ++i)
      if (const std::uint32_t code = codes[cells_[i].cell]; code != CellAttributes::kNoCode)
        places_[i].push_back(first + code);
    return true;
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
  std::vector<Tag> tags_;
  std::set<std::string> all_tags_;
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
  // The source of skeletons that were exported before.
  constexpr std::uint32_t kNone = UINT32_MAX;
  std::uint32_t given_source = kNone;
  if (attributes != nullptr) given_source = attributes->find("source").value_or(kNone);
  const auto isGiven = [&](const char* id) { return attributes != nullptr && attributes->find(id); };
  for (const SkeletonCell& cell : cells) {
    const CellRecord& record = store.cell(cell.cell);
    ids.push_back(std::to_string(cell.number));
    names.push_back(record.name);
    const AttributeValue source = given_source != kNone ? attributes->value(given_source, cell.cell) : AttributeValue();
    sources.push_back(isMissing(source) ? record.source : textOf(source));
    // A number has 32 bits. A cell with more samples does not fit a skeleton either.
    for (std::size_t i = 0; i < kNumbers.size(); ++i)
      numbers[i].push_back(std::min<std::uint64_t>(record.*kNumbers[i].second, UINT32_MAX));
  }
  PropertyJson properties = PropertyJson::array();
  const std::string label = attributes != nullptr ? unusedId("label", *attributes) : "label";
  properties.push_back({{"id", label}, {"type", "label"}, {"values", std::move(names)}});
  properties.push_back({{"id", "source"}, {"type", "description"}, {"values", std::move(sources)}});
  for (std::size_t i = 0; i < kNumbers.size(); ++i) {
    if (isGiven(kNumbers[i].first)) continue;
    properties.push_back(numberProperty(kNumbers[i].first, "uint32", std::move(numbers[i])));
    properties.back()["description"] = SegmentProperties::kComputed;
  }
  if (attributes != nullptr) {
    AttributeProperties more(cells, *attributes);
    for (std::uint32_t column = 0; column < attributes->columns().size(); ++column)
      if (column != given_source) more.add(column, properties);
    more.finish(properties);
  }
  const PropertyJson json{{"@type", "neuroglancer_segment_properties"},
                          {"inline", {{"ids", std::move(ids)}, {"properties", std::move(properties)}}}};
  return json.dump(-1, ' ', true, PropertyJson::error_handler_t::replace) + "\n";
}

}  // namespace filiform
