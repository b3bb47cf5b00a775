// InputAnatomy: the findings about all cells of an input, those that compare cells included.
//
//   InputAnatomy anatomy;
//   for (Cell cell; input.next(cell);) anatomy.add(cell);
//   anatomy.finish();
//   for (const CellFindings& cell : anatomy.cells()) std::cout << cell.source << '\n';
#pragma once

#include "index/anatomy/anatomy_check.h"
#include "index/anatomy/finding.h"
#include "index/cell/cell.h"

#include <array>
#include <cstdint>
#include <span>
#include <string>
#include <utility>
#include <vector>

namespace filiform {

struct CellFindings {
  std::string source, name;  // as in Cell; a name tells the cells of one source apart
  std::vector<Finding> findings;
  std::uint64_t digest = 0;  // as in Cell; tells cells of equal sources apart

  std::string shown() const { return name.empty() ? source : source + " (cell " + name + ")"; }
  bool anyDoubt() const;
};

// Thread rule: thread-compatible.
class InputAnatomy {
 public:
  // kOtherUnit: the extent and the median link of a cell are both more than kOtherSize times those of the median cell
  // of its folder, or less than the inverse, and their geometric mean differs by more than kOtherScale. Folders with
  // fewer than kLeastCells measured cells are compared with all cells.
  //
  // kFlatZ is a note where it is the rule: in a folder of at least kLeastCells cells of which more than half are flat.
  static constexpr double kOtherSize = 10, kOtherScale = 50;
  static constexpr std::size_t kLeastCells = 3;

  // Returns the findings about this cell alone, for a picture or a score. Valid until the next call. Cost and memory:
  // AnatomyCheck, and about 60 bytes a cell besides its source.
  const std::vector<Finding>& add(const Cell& cell);
  // What this object has, for the same object of another process; take() adds it after what is there. Before finish().
  std::vector<std::uint8_t> encode() const;
  void take(std::span<const std::uint8_t> bytes);
  // Adds kOtherUnit and kDuplicate, and compares kFlatZ. Call it once, after the last cell. O(cells log cells).
  void finish();

  // Cells with findings, in the order of add(). Final after finish().
  const std::vector<CellFindings>& cells() const { return cells_; }
  std::uint64_t doubts() const;  // findings that are doubts
  // Cells with such a finding that is a doubt (`doubt`) or a note.
  std::uint64_t count(FindingKind kind, bool doubt) const;

 private:
  struct Measure {
    std::string source, name;
    std::uint64_t digest = 0;
    std::uint64_t content = 0;  // digest of samples and links; 0: fewer than two samples
    float step_um = 0, extent_um = 0;
    bool flat = false;  // has kFlatZ
  };
  Finding& findingAt(std::size_t measure, FindingKind kind);
  void findOtherUnits();
  void excuseFlatFolders();
  void findDuplicates();

  AnatomyCheck check_;
  std::vector<Measure> measures_;
  std::vector<CellFindings> cells_;
  std::vector<std::uint32_t> measure_of_;                    // by cell of cells_
  std::vector<std::pair<std::uint32_t, Finding>> compared_;  // by measure, until finish() merges them
};

}  // namespace filiform
