// Contact sites as rows of a table, as JSON, as arrays of NumPy, and as a matrix between values of an attribute.
// tools/README.md lists the columns. Thread rule: thread-compatible.
#pragma once

#include "index/attributes/cell_attributes.h"
#include "index/contacts/contacts.h"
#include "index/set/tile_store.h"

#include <array>
#include <cstdint>
#include <iosfwd>
#include <map>
#include <string>
#include <vector>

#include <nlohmann/json.hpp>

namespace filiform::tools {

std::string contactTitles();  // the first line
void appendContactRow(std::string& rows, const TileStore& store, const ContactSite& site);
nlohmann::ordered_json contactJson(const TileStore& store, const ContactSite& site);  // the row; null: no value

// One array a column; `cells` has the name of each cell of the set.
class ContactArrays {
 public:
  explicit ContactArrays(const TileStore& store) : store_(store) {}  // it must outlive this object
  void add(const ContactSite& site);
  std::uint64_t bytes() const;
  std::size_t columns() const;
  std::string title(std::size_t column) const;  // without `.npy`
  std::string npy(std::size_t column) const;

 private:
  struct Column {
    std::string title, type;
    std::size_t width;  // values a row
  };
  static const std::vector<Column>& all();
  const TileStore& store_;
  std::uint64_t rows_ = 0;
  std::vector<std::string> values_;  // by column: the bytes of the array without its header
};

// Counts sites between the values of an attribute. If both sides have the same conditions, a site between different
// values counts in both directions.
class ContactMatrix {
 public:
  static constexpr std::size_t kMostValues = 4096;
  // Throws UsageError if the cells have more different values.
  ContactMatrix(const CellAttributes& attributes, std::uint32_t column, const std::vector<std::uint32_t>& from,
                const std::vector<std::uint32_t>& to, bool both_ways);
  void add(const ContactSite& site);
  // A first line with the values of `to`, then a line for each value of `from`. `-`: cells without a value.
  void write(std::ostream& out) const;

 private:
  struct Axis {
    std::map<std::uint32_t, std::uint32_t> place_of;  // by cell
    std::vector<std::string> values;
  };
  static Axis axisOf(const CellAttributes& attributes, std::uint32_t column, const std::vector<std::uint32_t>& cells);
  std::uint64_t& at(std::uint32_t from, std::uint32_t to);
  std::array<Axis, 2> axes_;
  bool both_ways_;
  std::string title_;
  std::vector<std::uint64_t> counts_;  // by value of `from`, then of `to`
};

}  // namespace filiform::tools
