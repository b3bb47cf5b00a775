#include "index/circuits/internal/node_table.h"

#include "index/count_text.h"
#include "index/errors.h"
#include "index/file/internal/bytes.h"
#include "index/text.h"

#include <algorithm>
#include <bit>
#include <cerrno>
#include <cmath>
#include <fstream>
#include <set>
#include <utility>

namespace filiform::internal {
namespace {

constexpr std::uint64_t kMostNodes = std::uint64_t{1} << 31;
constexpr std::string_view kPlacing[] = {
    "orientation_w",        "orientation_x",        "orientation_y",        "orientation_z",
    "rotation_angle_xaxis", "rotation_angle_yaxis", "rotation_angle_zaxis", "recenter"};

// Names of files: text, whatever they look like.
constexpr std::string_view kKeys[] = {"morphology", "morphology_file"};

bool places(std::string_view attribute) {
  return std::find(std::begin(kPlacing), std::end(kPlacing), attribute) != std::end(kPlacing);
}

// The names of the columns into which an array of some values a row is split; empty if it is no known one.
std::vector<std::string> parts(const std::string& name, std::uint32_t width) {
  if (name == "positions" && width == 3) return {"x", "y", "z"};
  if (name == "orientation" && width == 4) return {"orientation_w", "orientation_x", "orientation_y", "orientation_z"};
  if (width == 1) return {name};
  return {};
}

// Splits a line of node_types.csv at single blanks; a field may stand in double quotes.
std::vector<std::string> fieldsOf(const std::string& line) {
  std::vector<std::string> fields(1);
  bool quoted = false;
  for (const char c : line) {
    if (c == '"')
      quoted = !quoted;
    else if (c == ' ' && !quoted)
      fields.emplace_back();
    else
      fields.back() += c;
  }
  return fields;
}

}  // namespace

// Takes the records of a population.
struct NodeTable::Reading {
  struct Open {
    std::int64_t group = 0;
    hdf5::ColumnType type = hdf5::ColumnType::real;
    std::uint32_t width = 1;
    std::uint64_t rows = 0, taken = 0;
    std::vector<std::string> names;
    std::vector<Column> columns;
    std::vector<std::unordered_map<std::string, std::uint32_t>> codes;
  };
  explicit Reading(NodeTable& node_table) : table(node_table) {}

  void record(hdf5::RecordKind kind, Hdf5Bytes bytes) {
    ByteReader in(bytes);
    if (kind == hdf5::RecordKind::skipped) {
      std::vector<std::string> texts;
      splitNames(bytes, [&](std::string_view text) { texts.emplace_back(text); });
      in.require(texts.size() == 2, "a record of the wrong form");
      table.skipped_.push_back("'" + texts[0] + "': " + texts[1]);
    } else if (kind == hdf5::RecordKind::column) {
      close();
      Open column;
      column.group = in.i64();
      const std::uint32_t type = in.u32();
      in.require(type <= static_cast<std::uint32_t>(hdf5::ColumnType::text), "a column of an unknown type");
      column.type = static_cast<hdf5::ColumnType>(type);
      column.width = in.u32();
      column.rows = in.u64();
      in.require(column.width >= 1 && column.width <= 16 && column.rows <= kMostNodes, "a column that is too large");
      const ByteSpan name = in.take(in.left());
      const std::string text(name.begin(), name.end());
      column.names = parts(text, column.width);
      if (column.names.empty())
        table.skipped_.push_back("'" + text + "': has " + counted(column.width, "value") + " a node");
      column.columns.resize(column.width);
      column.codes.resize(column.width);
      for (Column& one : column.columns) one.type = column.type;
      open = std::move(column);
    } else if (kind == hdf5::RecordKind::values) {
      in.require(open.has_value(), "values without a column");
      while (in.left() > 0) value(in);
    }
  }

  void value(ByteReader& in) {
    Open& to = *open;
    in.require(to.taken < to.rows * to.width, "more values than rows");
    const std::size_t part = to.taken % to.width;
    Column& column = to.columns[part];
    ++to.taken;
    if (to.type == hdf5::ColumnType::real) {
      column.reals.push_back(in.f64());
    } else if (to.type == hdf5::ColumnType::integer) {
      column.integers.push_back(in.i64());
    } else {
      const ByteSpan bytes = in.take(in.u32());
      const std::string text(bytes.begin(), bytes.end());
      const auto [at, added] = to.codes[part].try_emplace(text, static_cast<std::uint32_t>(column.texts.size()));
      if (added) column.texts.push_back(text), table.bytes_ += 2 * text.size() + 64;
      column.codes.push_back(at->second);
    }
    table.bytes_ += to.type == hdf5::ColumnType::text ? 4 : 8;
  }

  void close() {
    if (!open) return;
    if (open->taken != open->rows * open->width) throw Damage{0, "fewer values than rows"};
    for (std::size_t i = 0; i < open->names.size(); ++i) {
      open->columns[i].rows = open->rows;
      if (std::find(std::begin(kKeys), std::end(kKeys), open->names[i]) == std::end(kKeys))
        open->columns[i].numbers = exactNumbers(open->columns[i].texts).value_or(std::vector<AttributeValue>());
      table.groups_[open->group][open->names[i]] = std::move(open->columns[i]);
    }
    open.reset();
  }

  NodeTable& table;
  std::optional<Open> open;
};

std::vector<std::string> listPopulations(Hdf5Process& process, const std::string& nodes_file) {
  std::vector<std::string> names;
  process.ask("populations", nodes_file, {}, [&](hdf5::RecordKind kind, Hdf5Bytes bytes) {
    if (kind == hdf5::RecordKind::names) splitNames(bytes, [&](std::string_view name) { names.emplace_back(name); });
  });
  return names;
}

AttributeValue NodeTable::Column::at(std::uint64_t row) const {
  switch (type) {
    case hdf5::ColumnType::real:
      return std::isnan(reals[row]) ? AttributeValue() : AttributeValue(reals[row]);
    case hdf5::ColumnType::integer:
      return integers[row];
    default:
      if (!numbers.empty()) return numbers[codes[row]];
      return texts[codes[row]].empty() ? AttributeValue() : AttributeValue(texts[codes[row]]);
  }
}

void NodeTable::fail(std::optional<std::uint64_t> node, const std::string& what) const {
  throw InputError(inShort(file_) + ": population " + escaped(population_, 200) +
                   (node ? ", node " + std::to_string(*node) : "") + ": " + what);
}

NodeTable::NodeTable(Hdf5Process& process, const std::string& nodes_file, const std::string& population,
                     const std::string& node_types_file)
    : file_(nodes_file), population_(population) {
  const std::vector<std::string> there = listPopulations(process, nodes_file);
  if (std::find(there.begin(), there.end(), population) == there.end()) {
    std::string all;
    for (const std::string& name : there) all += (all.empty() ? "" : ", ") + escaped(name, 100);
    throw InputError(inShort(nodes_file) + ": holds no population " + escaped(population, 100) +
                     (all.empty() ? "; it holds none" : "; it holds " + escaped(all, 600)));
  }
  read([&](const UseRecord& use) { process.ask("population", nodes_file, {population}, use); });
  if (!node_types_file.empty()) readTypes(node_types_file);
}

NodeTable::NodeTable(const std::string& nodes_file, const std::string& population,
                     const std::function<void(const UseRecord&)>& records)
    : file_(nodes_file), population_(population) {
  read(records);
}

void NodeTable::read(const std::function<void(const UseRecord&)>& records) {
  Reading reading(*this);
  records([&](hdf5::RecordKind kind, Hdf5Bytes bytes) { reading.record(kind, bytes); });
  try {
    reading.close();
  } catch (const Damage& damage) {
    fail({}, damage.what);
  }
  const auto take = [&](const char* name) -> std::vector<std::int64_t> {
    Group& own = groups_[-1];
    const auto found = own.find(name);
    if (found == own.end()) return {};
    if (found->second.type != hdf5::ColumnType::integer) fail({}, std::string(name) + " is not an array of integers");
    return std::move(found->second.integers);
  };
  type_of_ = take("node_type_id");
  group_of_ = take("node_group_id");
  index_of_ = take("node_group_index");
  groups_.erase(-1);
  checkGroups();
}

// Decides the number of nodes, and leaves out attributes whose length differs from that of their group.
void NodeTable::checkGroups() {
  nodes_ = type_of_.size();
  if (type_of_.empty() && !groups_.empty()) {
    const Group& first = groups_.begin()->second;
    for (const char* const name : {"x", "morphology", "morphology_file", "start_x"})
      if (const auto found = first.find(name); nodes_ == 0 && found != first.end()) nodes_ = found->second.rows;
    if (nodes_ == 0 && !first.empty()) nodes_ = first.begin()->second.rows;
  }
  if (nodes_ > UINT32_MAX - 2) fail({}, "more than 2^32 - 3 nodes");
  if (group_of_.empty() != index_of_.empty() || (!group_of_.empty() && group_of_.size() != index_of_.size()))
    fail({}, "node_group_id and node_group_index differ in length");
  std::map<std::int64_t, std::uint64_t> sizes;
  if (group_of_.empty()) {
    if (groups_.size() > 1) fail({}, "has several groups, but no node_group_id and node_group_index");
    if (!groups_.empty()) sizes[groups_.begin()->first] = nodes_;
  } else {
    if (group_of_.size() != nodes_) fail({}, "node_group_id and node_type_id differ in length");
    for (std::uint64_t n = 0; n < nodes_; ++n) {
      if (index_of_[n] < 0) fail(n, "its node_group_index is negative");
      std::uint64_t& size = sizes[group_of_[n]];
      size = std::max(size, static_cast<std::uint64_t>(index_of_[n]) + 1);
    }
  }
  for (auto& [number, group] : groups_) {
    const std::uint64_t size = sizes.count(number) != 0 ? sizes[number] : 0;
    for (auto at = group.begin(); at != group.end();) {
      if (at->second.size() == size || (at->second.size() > size && !group_of_.empty())) {
        ++at;
        continue;
      }
      const std::string problem =
          "'" + at->first + "': has " + counted(at->second.size(), "value") + " for " + counted(size, "node");
      if (places(at->first) || at->first == "x" || at->first == "y" || at->first == "z" || at->first == "morphology" ||
          at->first == "morphology_file")
        fail({}, escaped(problem, 300));
      skipped_.push_back(problem);
      at = group.erase(at);
    }
  }
}

void NodeTable::readTypes(const std::string& file) {
  errno = 0;
  std::ifstream in(file, std::ios::binary);
  if (!in) throw IoError(inShort(file), "cannot read the table of node types", errno);
  std::string line;
  std::vector<FieldKinds> kinds;  // by column
  std::vector<std::vector<std::string>> rows;
  std::size_t number = 0, id_column = SIZE_MAX;
  while (std::getline(in, line)) {
    ++number;
    if (!line.empty() && line.back() == '\r') line.pop_back();
    if (line.empty()) continue;
    std::vector<std::string> fields = fieldsOf(line);
    if (id_column == SIZE_MAX) {
      const auto at = std::find(fields.begin(), fields.end(), "node_type_id");
      if (at == fields.end())
        throw InputError(inShort(file) + ":" + std::to_string(number) +
                         ": has no column node_type_id; columns are separated by one blank");
      id_column = static_cast<std::size_t>(at - fields.begin());
      type_columns_ = std::move(fields);
      continue;
    }
    if (fields.size() != type_columns_.size())
      throw InputError(inShort(file) + ":" + std::to_string(number) + ": has " + std::to_string(fields.size()) +
                       " columns instead of " + std::to_string(type_columns_.size()));
    kinds.resize(fields.size());
    for (std::size_t i = 0; i < fields.size(); ++i) {
      if (fields[i] == "NULL") fields[i].clear();
      kinds[i].add(fields[i]);
    }
    const AttributeValue value = attributeFrom(fields[id_column]);
    const auto* const id = std::get_if<std::int64_t>(&value);
    if (id == nullptr)
      throw InputError(inShort(file) + ":" + std::to_string(number) + ": node_type_id is '" +
                       escaped(fields[id_column], 40) + "', not an integer");
    type_rows_.emplace(*id, rows.size());
    rows.push_back(std::move(fields));
  }
  for (const std::vector<std::string>& row : rows) {
    std::vector<AttributeValue>& values = types_.emplace_back();
    for (std::size_t i = 0; i < row.size(); ++i) values.push_back(kinds[i].valueOf(row[i]));
  }
}

std::optional<std::size_t> NodeTable::typeOf(std::uint64_t node) const {
  if (node >= type_of_.size()) return std::nullopt;
  const auto found = type_rows_.find(type_of_[node]);
  return found == type_rows_.end() ? std::nullopt : std::optional(found->second);
}

bool NodeTable::has(std::string_view attribute) const {
  if (std::find(type_columns_.begin(), type_columns_.end(), attribute) != type_columns_.end()) return true;
  return std::any_of(groups_.begin(), groups_.end(),
                     [&](const auto& group) { return group.second.find(attribute) != group.second.end(); });
}

AttributeValue NodeTable::value(std::string_view attribute, std::uint64_t node) const {
  const auto group = group_of_.empty() ? groups_.begin() : groups_.find(group_of_[node]);
  if (group != groups_.end()) {
    const auto column = group->second.find(attribute);
    if (column != group->second.end()) {
      AttributeValue found = column->second.at(index_of_.empty() ? node : static_cast<std::uint64_t>(index_of_[node]));
      if (!isMissing(found)) return found;
    }
  }
  if (const auto type = typeOf(node)) {
    const auto at = std::find(type_columns_.begin(), type_columns_.end(), attribute);
    if (at != type_columns_.end()) return types_[*type][static_cast<std::size_t>(at - type_columns_.begin())];
  }
  return {};
}

std::optional<double> NodeTable::number(std::string_view attribute, std::uint64_t node) const {
  const AttributeValue found = value(attribute, node);
  if (std::holds_alternative<std::string>(found))
    fail(node, std::string(attribute) + " is the text '" + escaped(textOf(found), 60) + "', not a number");
  return numberOf(found);
}

std::string NodeTable::text(std::string_view attribute, std::uint64_t node) const {
  const AttributeValue found = value(attribute, node);
  if (std::holds_alternative<double>(found))  // an integer may be a name
    fail(node, std::string(attribute) + " is the number " + textOf(found) + ", not text");
  return textOf(found);
}

void NodeTable::attributesOf(std::uint64_t node, std::vector<CellAttribute>& attributes) const {
  attributes.push_back({"population", population_});
  attributes.push_back({"node_id", static_cast<std::int64_t>(node)});
  const auto group = group_of_.empty() ? groups_.begin() : groups_.find(group_of_[node]);
  if (group != groups_.end()) {
    const std::uint64_t row = index_of_.empty() ? node : static_cast<std::uint64_t>(index_of_[node]);
    for (const auto& [name, column] : group->second)
      if (AttributeValue found = column.at(row); !places(name) && !isMissing(found))
        attributes.push_back({name, std::move(found)});
  }
  if (const auto type = typeOf(node))  // those of the file come first and win
    for (std::size_t i = 0; i < type_columns_.size(); ++i)
      if (!places(type_columns_[i]) && !isMissing(types_[*type][i]))
        attributes.push_back({type_columns_[i], types_[*type][i]});
}

}  // namespace filiform::internal
