// A table that places morphologies, each any number of times: whole columns from a library of reconstructions.
//
// TSV with the header line `source x_um y_um z_um qw qx qy qz name`: the source of a cell of the input, as
// index/input.h forms it; then the rigid placement, a rotation by the unit quaternion followed by a translation in W;
// then a name, which may be empty. The input becomes a library: only what the table places goes on. A placed cell keeps
// the source, ids, links, radii and types of its morphology; its digest is that of the morphology and its placement.
//
//   Input library({"lib.zip"});
//   PlacedCells cells(library, PlacementTable::read("column.tsv"));
//   ingest(cells, "column.fil");
#pragma once

#include "index/cell.h"
#include "index/input.h"

#include <array>
#include <cstdint>
#include <string>
#include <string_view>
#include <unordered_map>
#include <vector>

namespace filiform {

// Immutable.
class PlacementTable {
 public:
  struct Row {
    std::uint32_t source;            // in sources()
    std::uint32_t line;              // of the table, from 1
    std::array<double, 3> moved_um;  // frame W
    std::array<double, 4> turned;    // w, x, y, z; of length 1
    std::uint64_t name_at;           // see name()
    std::uint32_t name_bytes;
  };

  // A quaternion may be this far from length 1: tables hold rounded numbers. It is then made 1.
  static constexpr double kLengthTolerance = 1e-3;
  static constexpr std::size_t kMaxLine = 65536;  // bytes

  // Throws InputError naming file and line for a wrong header, a row with too few or too many columns, a number that is
  // none or not finite, a quaternion that is not of length 1, an empty source; IoError. O(bytes); about 100 bytes a
  // row.
  static PlacementTable read(const std::string& path);
  // `file` is for messages.
  static PlacementTable parse(std::string_view text, const std::string& file);

  // In the order of the table.
  const std::vector<Row>& rows() const { return rows_; }
  const std::vector<std::string>& sources() const { return sources_; }  // each once
  std::string_view name(const Row& row) const { return std::string_view(names_).substr(row.name_at, row.name_bytes); }
  const std::string& file() const { return file_; }  // base name
  std::uint64_t bytes() const { return bytes_; }
  std::uint64_t digest() const { return digest_; }  // of the rows, whatever their order

 private:
  class Parser;

  std::string file_, names_;
  std::uint64_t bytes_ = 0, digest_ = 0;
  std::vector<Row> rows_;
  std::vector<std::string> sources_;
};

struct PlacementReport {
  std::uint64_t rows = 0, placed = 0;  // rows whose morphology was refused are not placed
  std::uint64_t morphologies = 0;      // placed at least once
  std::uint64_t samples = 0, segments = 0;
  // W_RANGE: a sample beyond the grid once placed; W_MISSING_PARENT: the link to it; W_BAD_LINE: a row that is not
  // placed. The line is that of the table.
  std::uint64_t dropped_samples = 0, cut_links = 0;
  CodeCounts codes;
  InputRecords records;  // equal lines by code, then token
};

// For InputOptions::cell_share of the library: a cell is there twice while it is placed.
inline constexpr double kPlacedCellShare = 0.4;

// One morphology and one placed cell are in memory at a time. Thread-compatible.
class PlacedCells : public CellStream {
 public:
  // Keeps a reference to the input, which must outlive it and be at its start. Throws InputError naming the table's
  // line when a source is not in the input, or is so twice.
  PlacedCells(Input& library, PlacementTable table);

  // Cells in the order of ids: by source, then by digest; the order of rows and arguments does not matter. Throws as
  // Input::next. O(samples).
  bool next(Cell& cell) override;

  // Complete when next() has returned false.
  const PlacementReport& report() const { return report_; }
  const PlacementTable& table() const { return table_; }

  // About the memory that table and reports take.
  std::uint64_t held_bytes() const;

  // Starts over.
  void rewind();

 private:
  struct Turn {
    std::uint64_t digest;
    std::uint32_t row;
  };
  void orderRows();
  void skipRows(std::uint32_t source);
  void record(std::uint32_t line, InputCode code, Effect effect, std::string token);
  void orderRecords();
  bool place(const PlacementTable::Row& row, std::uint64_t digest, Cell& cell);  // false: nothing of it is left
  void dropOutside(const PlacementTable::Row& row, Cell& cell);

  Input& library_;
  PlacementTable table_;
  std::unordered_map<std::string_view, std::uint32_t> source_numbers_;
  std::vector<std::uint32_t> by_source_, begin_;  // rows by source, and where each source's begin
  std::vector<std::uint8_t> met_;                 // by source: has the library handed it out
  Cell morphology_;
  std::uint64_t links_ = 0;  // of the morphology
  std::vector<Turn> turns_;  // of the morphology, in the order of digests
  std::size_t next_turn_ = 0;
  PlacementReport report_;
  struct Repeated {
    InputRecord record;
    std::uint64_t count;
  };
  std::vector<Repeated> records_;  // a few of each row
};

}  // namespace filiform
