// MeasureTable: the rows of `measure`: which columns they have, and what stands in them. The command, the service and
// the Python package show the same. MEASURES.md of index/measure defines the features. Thread rule: thread-compatible.
#pragma once

#include "index/measure/cell_measures.h"
#include "index/set/tile_store.h"

#include <cstdint>
#include <functional>
#include <string>
#include <vector>

#include <nlohmann/json.hpp>

namespace filiform::tools {

enum class MeasureRows : std::uint8_t { kCell, kNeurite, kBranch, kType, kSet };

struct MeasureChoice {
  MeasureRows rows = MeasureRows::kCell;
  std::vector<const Feature*> features;
  std::vector<std::uint16_t> types;        // empty: all
  double sholl_um = 0;                     // 0: without
  std::uint64_t memory_bytes = 256 << 20;  // for the cells that are read at a time, see CellPass
};

// Each throws UsageError, which names `option` and near names.
// `cell`, `neurite`, `branch`, `type` or `set`.
MeasureRows parseMeasureRows(const std::string& word, const std::string& option = "--per");
// Names with commas between; `all` stands for all features.
std::vector<const Feature*> parseFeatures(const std::string& names, const std::string& option = "--features");
// Words or codes with commas between: `axon,basal`.
std::vector<std::uint16_t> parseNeuriteTypes(const std::string& names, const std::string& option = "--type");
// The features of a table without --features.
inline constexpr const char* kUsualFeatures =
    "neurites,sections,bifurcations,tips,length,area,volume,tip_path_max,tip_radial_max,branch_order_max,strahler_max";

class MeasureTable {
 public:
  struct Value {
    enum class Kind : std::uint8_t { kCount, kNumber, kText, kCounts } kind = Kind::kCount;
    std::int64_t count = 0;
    double number = 0;  // NaN: none
    std::string text;
    std::vector<std::uint64_t> counts;
  };
  using Row = std::vector<Value>;  // by column
  struct Column {
    std::string title;
    Value::Kind kind;
  };

  // `store` must outlive this object.
  MeasureTable(const TileStore& store, MeasureChoice choice);
  const std::vector<Column>& columns() const { return columns_; }

  // Measures the cells and calls row() for each row, in order: by cell, then as CellMeasures::parts has them. `check`
  // is called between groups of cells with the number of cells done; its exceptions propagate. Throws as
  // measureCells().
  void measure(const std::vector<std::uint32_t>& cells, unsigned threads,
               const std::function<void(std::size_t done)>& check, const std::function<void(const Row&)>& row) const;

 private:
  Row rowOf(std::uint32_t cell, const MeasuredPart* part, const Measures& measures, const SomaShape* soma) const;
  const TileStore& store_;
  MeasureChoice choice_;
  std::vector<Column> columns_;
};

// Null for none, an array for counts.
nlohmann::ordered_json measureJson(const MeasureTable::Value& value);
// "-" for none; counts with commas between.
std::string measureText(const MeasureTable::Value& value);

}  // namespace filiform::tools
