#include "index/formats/neuroglancer/internal/segment_properties.h"

#include "index/errors.h"
#include "index/formats/neuroglancer/internal/bounded_json.h"
#include "index/formats/neuroglancer/object_ids.h"
#include "index/text.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <numeric>
#include <set>
#include <utility>

namespace filiform {
namespace {

using Json = nlohmann::json;

constexpr std::size_t kMostPropertyColumns = 4096;
constexpr std::uint64_t kMostTagValues = std::uint64_t{1} << 24;  // of the columns that tags give, for their memory
constexpr std::uint64_t kLargestInteger = std::numeric_limits<std::int64_t>::max();

std::string memberOf(const Json& json, const char* key) {
  return json.contains(key) && json[key].is_string() ? json[key].get<std::string>() : std::string();
}

// An integer of JSON, also one that is written as a real.
AttributeValue integerFrom(const Json& number) {
  const auto real = number.get<double>();
  if (number.is_number_unsigned() && number.get<std::uint64_t>() > kLargestInteger) return real;
  if (!number.is_number_float()) return number.get<std::int64_t>();
  constexpr double kLargestExact = 9007199254740992;  // 2^53
  if (real == std::floor(real) && std::abs(real) <= kLargestExact) return static_cast<std::int64_t>(real);
  return real;
}

AttributeValue textFrom(std::string text) { return text.empty() ? AttributeValue() : AttributeValue(std::move(text)); }

}  // namespace

struct SegmentProperties::Reader {
  SegmentProperties& result;
  const std::string& file;
  std::size_t objects = 0;
  std::set<std::string> names{};  // of columns

  [[noreturn]] void fail(const std::string& what) const { throw InputError(inShort(file) + ": " + what); }

  void readIds(const Json& list) {
    std::vector<std::uint64_t> ids;
    for (const Json& id : list) {
      ids.emplace_back();
      if (!id.is_string() || !readObjectId(id.get_ref<const std::string&>(), ids.back()))
        fail("id " + std::to_string(ids.size()) + " is not a text of decimal digits from 0 to 2^64-1");
      result.ids_fit_ = result.ids_fit_ && ids.back() <= kLargestInteger;
    }
    objects = ids.size();
    std::vector<std::uint32_t> order(ids.size());
    std::iota(order.begin(), order.end(), 0U);
    std::stable_sort(order.begin(), order.end(), [&](std::uint32_t a, std::uint32_t b) { return ids[a] < ids[b]; });
    for (const std::uint32_t row : order) {
      if (!result.ids_.empty() && result.ids_.back() == ids[row]) continue;
      result.ids_.push_back(ids[row]);
      result.rows_.push_back(row);
    }
  }

  std::vector<AttributeValue>& addColumn(const std::string& name) {
    if (!names.insert(name).second) fail("two properties have the id " + escaped(name, 100) + "; rename one of them");
    if (result.columns_.size() == kMostPropertyColumns)
      fail("has more than " + std::to_string(kMostPropertyColumns) + " properties");
    result.columns_.push_back({name, std::vector<AttributeValue>(objects)});
    return result.columns_.back().values;
  }

  void readProperty(const Json& property) {
    const std::string id = property.is_object() ? memberOf(property, "id") : std::string();
    if (id.empty()) fail("one of its properties has no id");
    const std::string type = memberOf(property, "type"), about = memberOf(property, "description");
    if (about == kComputed) return;
    const bool known =
        type == "label" || type == "description" || type == "string" || type == "number" || type == "tags";
    if (!known || (type == "label" && !result.labels_.empty())) {
      result.left_out_.push_back(id);
      return;
    }
    if (!property.contains("values") || !property["values"].is_array() || property["values"].size() != objects)
      fail("its property " + escaped(id, 100) + " has not one value for each of its " + std::to_string(objects) +
           " ids; mend it, or take segment_properties out of the info of the skeletons");
    const Json& values = property["values"];
    if (type == "label") {
      result.labels_.resize(objects);
      for (std::size_t row = 0; row < objects; ++row) result.labels_[row] = textOf(valueFrom(values[row], id, true));
    } else if (type == "tags") {
      readTags(property, id);
    } else {
      std::vector<AttributeValue>& column = addColumn(id);
      const bool real = memberOf(property, "data_type") == "float32";
      for (std::size_t row = 0; row < objects; ++row) {
        column[row] = valueFrom(values[row], id, type != "number");
        if (type == "number" && real) {
          if (const auto number = numberOf(column[row])) column[row] = *number;
        } else if (type == "string" && (about == "integer" || about == "real")) {
          const AttributeValue number = attributeFrom(textOf(column[row]));
          if (numberOf(number)) column[row] = about == "real" ? AttributeValue(*numberOf(number)) : number;
        }
      }
    }
  }

  AttributeValue valueFrom(const Json& value, const std::string& id, bool text) const {
    if (value.is_null()) return {};
    if (value.is_string() && text) return textFrom(value.get<std::string>());
    if (!value.is_number()) fail("a value of its property " + escaped(id, 100) + " has the wrong type");
    return text ? textFrom(value.dump()) : integerFrom(value);
  }

  // The tag as it was before its blanks were replaced, where its description says so.
  static std::string originalOf(const std::string& tag, const std::string& description) {
    const bool same = std::equal(tag.begin(), tag.end(), description.begin(), description.end(), [](char a, char b) {
      return a == b || (a == '_' && static_cast<unsigned char>(b) <= 0x20);
    });
    return same ? description : tag;
  }

  void readTags(const Json& property, const std::string& id) {
    std::vector<std::string> tags;
    if (!property.contains("tags") || !property["tags"].is_array()) fail("its tags are not a list");
    const Json* const about = property.contains("tag_descriptions") ? &property["tag_descriptions"] : nullptr;
    for (const Json& tag : property["tags"]) {
      if (!tag.is_string()) fail("one of its tags is not a text");
      tags.push_back(tag.get<std::string>());
      if (about != nullptr && about->is_array() && tags.size() <= about->size() &&
          (*about)[tags.size() - 1].is_string())
        tags.back() = originalOf(tags.back(), (*about)[tags.size() - 1].get<std::string>());
    }
    const std::set<std::string> taken = names;
    std::map<std::string, std::size_t> columns;              // places of those made here
    std::vector<std::pair<std::size_t, std::string>> parts;  // of each tag: column and text
    for (const std::string& tag : tags) {
      const std::size_t equals = tag.find('=');
      std::string name = tag.substr(0, std::min(equals, tag.size()));
      bool named = equals != std::string::npos && equals > 0 && equals + 1 < tag.size() && !taken.contains(name);
      if (named && !columns.contains(name))
        named = (columns.size() + 1) * objects <= kMostTagValues && result.columns_.size() + 1 < kMostPropertyColumns;
      if (!named) name = id;
      const auto [at, is_new] = columns.try_emplace(name, result.columns_.size());
      if (is_new) addColumn(name);
      parts.emplace_back(at->second, named ? tag.substr(equals + 1) : tag);
    }
    for (std::size_t row = 0; row < objects; ++row) {
      if (!property["values"][row].is_array()) fail("a value of its tags is not a list");
      for (const Json& place : property["values"][row]) {
        if (!place.is_number_unsigned() || place.get<std::uint64_t>() >= parts.size())
          fail("a value of its tags names none of them");
        const auto& [column, text] = parts[place.get<std::size_t>()];
        AttributeValue& value = result.columns_[column].values[row];
        value = isMissing(value) ? text : textOf(value) + " " + text;
      }
    }
  }
};

SegmentProperties::SegmentProperties(std::string_view text, const std::string& file) {
  Reader reader{*this, file};
  const Json json = internal::boundedJson(text);
  if (json.is_discarded()) reader.fail("is not the info of segment properties: no valid JSON of at most 64 levels");
  if (!json.is_object()) reader.fail("is not the info of segment properties");
  if (!json.contains("inline")) return;
  const Json& all = json["inline"];
  if (!all.is_object() || !all.contains("ids") || !all["ids"].is_array())
    reader.fail("holds no list inline.ids of segment properties");
  reader.readIds(all["ids"]);
  if (all.contains("properties")) {
    if (!all["properties"].is_array()) reader.fail("its properties are not a list");
    // Tags come last, so that their names give way to those of properties.
    for (const bool tags : {false, true})
      for (const Json& property : all["properties"])
        if ((property.is_object() && memberOf(property, "type") == "tags") == tags) reader.readProperty(property);
  }
  held_bytes_ = ids_.size() * (16 + sizeof(std::string) + columns_.size() * sizeof(AttributeValue)) + text.size();
}

void SegmentProperties::apply(std::uint64_t id, Cell& cell) const {
  const auto has_id = std::any_of(columns_.begin(), columns_.end(), [](const Column& c) { return c.name == "id"; });
  if (!has_id)
    cell.attributes.push_back({"id", ids_fit_ && id <= kLargestInteger ? AttributeValue(static_cast<std::int64_t>(id))
                                                                       : AttributeValue(std::to_string(id))});
  const auto at = std::lower_bound(ids_.begin(), ids_.end(), id);
  if (at == ids_.end() || *at != id) return;
  const std::uint32_t row = rows_[static_cast<std::size_t>(at - ids_.begin())];
  if (!labels_.empty()) cell.name = labels_[row];
  for (const Column& column : columns_)
    if (!isMissing(column.values[row])) cell.attributes.push_back({column.name, column.values[row]});
}

}  // namespace filiform
