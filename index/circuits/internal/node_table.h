// NodeTable: the attributes of one population of SONATA nodes: those in the file of nodes, and those that
// node_types.csv states for the node's type. A value in the file of nodes wins.
#pragma once

#include "index/cell/attribute.h"
#include "index/hdf5/internal/hdf5_process.h"

#include <cstdint>
#include <functional>
#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <unordered_map>
#include <vector>

namespace filiform::internal {

// The populations of a file of nodes, ascending. Throws IoError.
std::vector<std::string> listPopulations(Hdf5Process& process, const std::string& nodes_file);

// Thread rule: immutable once made.
class NodeTable {
 public:
  // `node_types_file` may be empty. Throws IoError if a file cannot be read. Throws InputError naming file and
  // population if the population does not exist (the message lists those that do), or if its groups or the number of
  // its nodes contradict each other. O(values); takes 8 bytes a number and 4 a text, and the different texts.
  NodeTable(Hdf5Process& process, const std::string& nodes_file, const std::string& population,
            const std::string& node_types_file);

  // The same from the records of the population, without a process and a table of types.
  NodeTable(const std::string& nodes_file, const std::string& population,
            const std::function<void(const UseRecord& use)>& records);

  std::uint64_t nodes() const { return nodes_; }
  const std::string& population() const { return population_; }
  bool has(std::string_view attribute) const;  // in the file or in the table of types, for any node
  // The value of a node; missing if it has none. `positions` counts as x, y, z, and `orientation` as orientation_w,
  // _x, _y, _z.
  AttributeValue value(std::string_view attribute, std::uint64_t node) const;
  // A number, or nullopt if the node has none. Throws InputError naming file, population, node and attribute for text.
  std::optional<double> number(std::string_view attribute, std::uint64_t node) const;
  std::string text(std::string_view attribute, std::uint64_t node) const;  // like number(), for numbers; empty: none
  // All values of a node, without those that place it (orientation, rotation, positions, recenter).
  void attributesOf(std::uint64_t node, std::vector<CellAttribute>& attributes) const;

  // Attributes that were left out, and why: "'name': reason".
  const std::vector<std::string>& skipped() const { return skipped_; }
  std::uint64_t held_bytes() const { return bytes_; }
  [[noreturn]] void fail(std::optional<std::uint64_t> node, const std::string& what) const;  // throws InputError

 private:
  struct Column {
    hdf5::ColumnType type = hdf5::ColumnType::real;
    std::uint64_t rows = 0;
    std::vector<double> reals;
    std::vector<std::int64_t> integers;
    std::vector<std::uint32_t> codes;
    std::vector<std::string> texts;
    std::vector<AttributeValue> numbers;  // not empty: what the texts say, such as the layer "6"
    AttributeValue at(std::uint64_t row) const;
    std::uint64_t size() const { return reals.size() + integers.size() + codes.size(); }
  };
  using Group = std::map<std::string, Column, std::less<>>;
  struct Reading;
  void read(const std::function<void(const UseRecord& use)>& records);
  void readTypes(const std::string& file);
  void checkGroups();
  std::optional<std::size_t> typeOf(std::uint64_t node) const;

  std::string file_, population_;
  std::uint64_t nodes_ = 0, bytes_ = 0;
  std::map<std::int64_t, Group> groups_;                     // -1: of the population
  std::vector<std::int64_t> group_of_, index_of_, type_of_;  // by node; empty: group 0, the node's number, no type
  std::vector<std::string> type_columns_;
  std::vector<std::vector<AttributeValue>> types_;  // rows of the table of types, by its columns
  std::unordered_map<std::int64_t, std::size_t> type_rows_;
  std::vector<std::string> skipped_;
};

}  // namespace filiform::internal
