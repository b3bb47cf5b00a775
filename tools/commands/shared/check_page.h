// The page of `check --report FILE.html`: each input with its verdict, its findings and a small picture, worst first.
// The page is one file without scripts, and loads nothing.
#pragma once

#include "index/anatomy/input_anatomy.h"
#include "index/cell/cell.h"
#include "index/input/source_report.h"

#include <cstddef>
#include <cstdint>
#include <iosfwd>
#include <string>
#include <unordered_map>
#include <vector>

namespace filiform::tools {

// An SVG of the cell seen along z, y upward: soma black, axon blue, dendrites red, others grey. At most kMostStrokes
// strokes; a larger cell is drawn on a coarser raster. Empty for a cell without links. O(samples) expected.
inline constexpr std::size_t kMostStrokes = 1500;
std::string cellPicture(const Cell& cell);

// Pictures of the cells that matter most. Thread rule: thread-compatible.
class CellPictures {
 public:
  static constexpr std::size_t kMost = 1000;  // pictures; of more cells, those with the most findings have one

  void add(const Cell& cell, const std::vector<Finding>& findings);
  // The picture of a source; empty if it has none. After the last add().
  const std::string& of(const std::string& source) const;

 private:
  void discardLeast(std::size_t most);

  struct Picture {
    std::string svg;
    double worth = 0;
    std::uint64_t number = 0;
  };
  std::unordered_map<std::string, Picture> pictures_;  // by source
  double least_worth_ = -1;                            // of those kept, once some were discarded
  std::uint64_t added_ = 0;
};

// `summary`: the first lines of the page, as text. The caller checks the stream for errors.
void writeCheckPage(std::ostream& out, const std::string& summary, const std::vector<SourceReport>& reports,
                    const InputAnatomy& anatomy, const CellPictures& pictures);

}  // namespace filiform::tools
