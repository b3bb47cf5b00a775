// A table that places morphologies, each any number of times. It makes whole columns from a library of reconstructions.
//
// The table is TSV with the header line `source x_um y_um z_um qw qx qy qz name`:
//   source           source of a cell of the input, as index/input/input.h forms it
//   qw qx qy qz      unit quaternion of the rotation, applied first
//   x_um y_um z_um   translation in frame W, applied second
//   name             name of the placed cell; may be empty
// Only morphologies that the table places go on. A placed cell keeps the source, ids, links, radii and types of its
// morphology. Its digest is that of the morphology and the placement.
//
//   Input library({"lib.zip"});
//   PlacedCells cells(library, PlacementTable::read("column.tsv"));
//   ingest(cells, "column.fil");
#pragma once

#include "index/cell/cell.h"
#include "index/input/input.h"

#include <array>
#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <unordered_map>
#include <utility>
#include <vector>

namespace filiform {

// The attributes of the rows of a table, in a form of the maker's choice. Thread rule: immutable.
class RowAttributes {
 public:
  virtual ~RowAttributes() = default;
  // Replaces `attributes` by those of a row.
  virtual void of(std::uint32_t row, std::vector<CellAttribute>& attributes) const = 0;
  virtual std::uint64_t held_bytes() const = 0;
};

// The rows of one table file, or of a circuit (circuit.h). Thread rule: immutable once made.
class PlacementTable {
 public:
  struct Row {
    std::uint32_t source;            // index in sources()
    std::uint32_t line;              // line in the table file, from 1
    std::array<double, 3> moved_um;  // translation, frame W
    std::array<double, 4> turned;    // rotation: unit quaternion w, x, y, z
    std::uint64_t name_at;           // offset of the name, see name()
    std::uint32_t name_bytes;
    bool by_soma;  // move the soma of the morphology to the origin first
  };

  // A quaternion may differ from length 1 by this much, since tables hold rounded numbers. It is then normalised.
  static constexpr double kLengthTolerance = 1e-3;
  static constexpr std::size_t kMaxLine = 65536;  // bytes

  // Reads a table. Throws InputError naming file and line for: a wrong header, a wrong number of columns, a field that
  // is not a finite number, a quaternion that is not of length 1, an empty source. Throws IoError. O(bytes); takes
  // about 100 bytes a row.
  static PlacementTable read(const std::string& path);
  // Like read(), for text in memory. Error messages name `file`.
  static PlacementTable parse(std::string_view text, const std::string& file);

  // A table to which rows are added one by one. `file`: for messages; `bytes`: of the files from which the rows come.
  PlacementTable() = default;
  PlacementTable(std::string file, std::uint64_t bytes) : file_(std::move(file)), bytes_(bytes) {}
  // Requires finite numbers and a unit quaternion. O(length) expected.
  void add(std::string_view source, std::string_view name, std::uint32_t line, const std::array<double, 3>& moved_um,
           const std::array<double, 4>& turned, bool by_soma);
  // The attributes of the rows, by their positions in rows(). Rows whose source is not in the input are then dropped
  // with a record, as those of a refused morphology are.
  void setAttributes(std::shared_ptr<const RowAttributes> attributes) { attributes_ = std::move(attributes); }
  const RowAttributes* attributes() const { return attributes_.get(); }  // nullptr: none

  // In the order of the table.
  const std::vector<Row>& rows() const { return rows_; }
  const std::vector<std::string>& sources() const { return sources_; }  // each source once
  std::string_view name(const Row& row) const { return std::string_view(names_).substr(row.name_at, row.name_bytes); }
  const std::string& file() const { return file_; }  // base name
  std::uint64_t bytes() const { return bytes_; }
  std::uint64_t digest() const { return digest_; }  // of the rows, independent of their order

 private:
  class Parser;

  std::string file_, names_;
  std::uint64_t bytes_ = 0, digest_ = 0;
  std::vector<Row> rows_;
  std::vector<std::string> sources_;
  std::unordered_map<std::string, std::uint32_t> numbers_;  // of the sources
  std::shared_ptr<const RowAttributes> attributes_;
};

struct PlacementReport {
  std::uint64_t rows = 0, placed = 0;  // a row whose morphology was refused is not placed
  std::uint64_t morphologies = 0;      // placed at least once
  std::uint64_t samples = 0, segments = 0;
  // W_SOMA_OFFSET: a morphology whose soma is moved to the origin by more than 1 um, at the first row that places it.
  // W_RANGE: a placed sample lies outside the grid. W_MISSING_PARENT: the link to such a sample is cut. W_BAD_LINE: a
  // row is not placed. The line of a record is the line of the table.
  std::uint64_t dropped_samples = 0, cut_links = 0;
  CodeCounts codes;
  InputRecords records;  // by line; equal lines by code, then token
};

// InputOptions::cell_share for the library: a cell is in memory twice while it is placed.
inline constexpr double kPlacedCellShare = 0.4;

// The stream of placed cells. Holds one morphology and one placed cell in memory. Thread rule: thread-compatible.
class PlacedCells : public CellStream {
 public:
  // Keeps a reference to `library`, which must outlive this object, and rewinds it. Throws InputError naming the
  // table's line if a source is missing in the input or is the source of two inputs.
  PlacedCells(Input& library, PlacementTable table);

  // Cells come in the order of ids: by source, then by digest. The order of rows and arguments has no effect. Throws as
  // Input::next(). O(samples).
  bool next(Cell& cell) override;

  // Complete after next() has returned false.
  const PlacementReport& report() const { return report_; }
  const PlacementTable& table() const { return table_; }

  // Approximate memory, in bytes, of the table and the reports.
  std::uint64_t held_bytes() const;

  // Returns to the first cell, for another pass.
  void rewind();

  // For several processes with the same library and table, each of which places some cells: of `count` about equal
  // consecutive parts, this object places part `part`. The library reads what this needs. Call it before the first
  // next(). report() is then complete only after takeReports(). Returns the range of sources from the first one of this
  // part to the first one of the next part, for other cells that are ordered among these; nullopt: the end.
  struct Sources {
    std::optional<std::string> begin, end;
    bool contain(const std::string& source) const { return begin && *begin <= source && (!end || source < *end); }
  };
  Sources keepPart(unsigned part, unsigned count);
  // After next() has returned false: the report on this part. takeReports() replaces the report by that of all parts.
  std::vector<std::uint8_t> encodeReport() const;
  void takeReports(const std::vector<std::vector<std::uint8_t>>& parts);

 private:
  struct Part {
    std::uint32_t begin = 0, end = UINT32_MAX;  // of the rows of a source, in the order of digests
  };
  struct Turn {
    std::uint64_t digest;
    std::uint32_t row;
  };
  void orderRows();
  void skipRows(std::uint32_t source);
  void record(std::uint32_t line, InputCode code, Effect effect, std::string token);
  void orderRecords();
  Part partOf(std::uint32_t source) const;
  bool place(const PlacementTable::Row& row, std::uint64_t digest, Cell& cell);  // false: no sample is left
  void dropOutside(const PlacementTable::Row& row, Cell& cell);

  Input& library_;
  PlacementTable table_;
  std::unordered_map<std::string_view, std::uint32_t> source_numbers_;
  std::vector<std::uint32_t> by_source_, begin_;  // rows by source, and where the rows of each source begin
  std::vector<Part> part_of_;                     // by source; empty: all rows
  std::vector<std::uint8_t> met_;                 // by source: true once the library has returned it
  Cell morphology_;
  std::uint64_t links_ = 0;              // of the morphology
  Vector3d soma_um_ = Vector3d::Zero();  // of the morphology: where its soma lies
  std::vector<Turn> turns_;              // placements of the morphology, in the order of digests
  std::size_t next_turn_ = 0;
  PlacementReport report_;
  struct Repeated {
    InputRecord record;
    std::uint64_t count;
  };
  std::vector<Repeated> records_;  // a few for each row
};

}  // namespace filiform
