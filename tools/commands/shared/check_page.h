// The page of `check --report FILE.html`: each input with its verdict, its findings and a small picture of each cell,
// worst first. The page is one file without scripts, and loads nothing.
#pragma once

#include "index/anatomy/input_anatomy.h"
#include "index/cell/cell.h"
#include "index/input/source_report.h"

#include <cstddef>
#include <cstdint>
#include <iosfwd>
#include <map>
#include <span>
#include <string>
#include <utility>
#include <vector>

namespace filiform::tools {

// An SVG of the cell seen along z, y upward: soma black, axon blue, dendrites red, others grey. At most kMostStrokes
// strokes; a larger cell is drawn on a coarser raster. Empty for a cell without links. O(samples) expected.
inline constexpr std::size_t kMostStrokes = 1500;
std::string cellPicture(const Cell& cell);

// Pictures of the cells that matter most. Thread rule: thread-compatible.
class CellPictures {
 public:
  // Of up to twice as many cells, each has a picture; of more cells, at least as many with the most findings.
  static constexpr std::size_t kMost = 1000;
  struct Picture {
    std::string name, svg;  // the name as in Cell
    double worth = 0;
    std::uint64_t number = 0;
  };

  void add(const Cell& cell, const std::vector<Finding>& findings);
  // The pictures of the cells of a source with this digest, in the order of add(). Valid until the next add().
  std::span<const Picture> of(const std::string& source, std::uint64_t digest) const;

 private:
  void discardLeast(std::size_t most);

  std::map<std::pair<std::string, std::uint64_t>, std::vector<Picture>> pictures_;  // by source and digest
  std::size_t held_ = 0;
  double least_worth_ = -1;  // of those kept, once some were discarded
  std::uint64_t added_ = 0;
};

// `summary`: the first lines of the page, as text. The caller checks the stream for errors.
void writeCheckPage(std::ostream& out, const std::string& summary, const std::vector<SourceReport>& reports,
                    const InputAnatomy& anatomy, const CellPictures& pictures);

}  // namespace filiform::tools
