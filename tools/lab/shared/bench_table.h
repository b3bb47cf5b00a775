// Tables of measurements, their values as text, and the machine on which they were measured. Functions without state.
#pragma once

#include <cstdint>
#include <string>
#include <utility>
#include <variant>
#include <vector>

namespace filiform::tools {

using BenchValue = std::variant<std::string, double, std::int64_t>;

// The value as text for tables: numbers with four significant digits.
std::string shown(const BenchValue& value);
// Processor, threads, memory, system, compiler, version of the program.
std::vector<std::pair<std::string, BenchValue>> machineFacts();

struct BenchTable {
  std::string name;     // a word; the key in the JSON
  std::string caption;  // a line, with units
  std::vector<std::string> columns;
  std::vector<std::vector<BenchValue>> rows;  // each as long as columns
  // The columns that identify a row, for `compare`; empty: the first column.
  std::vector<std::string> keys = {};
};

// The caption and the table as Markdown.
std::string markdownTable(const BenchTable& table);

// The value below which `fraction` of the values lie, by nearest rank; NaN if there are none. O(n).
double percentile(std::vector<double> values, double fraction);
inline double median(const std::vector<double>& values) { return percentile(values, 0.5); }

}  // namespace filiform::tools
