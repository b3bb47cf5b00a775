// One neuron as it was read (Cell), and the stream of cells that readers hand to the tiler. Every tile set is made from
// a stream of cells: SWC files, archive entries, synthetic columns and graphs.
#pragma once

#include "index/cell/attribute.h"
#include "index/cell/radius.h"
#include "index/errors.h"
#include "index/geometry/grid.h"

#include <array>
#include <cstdint>
#include <limits>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

namespace filiform {

// The parent of a root, and the radius of a sample whose file states none.
inline constexpr std::uint32_t kNoParent = UINT32_MAX;
inline constexpr float kUnknownRadius = std::numeric_limits<float>::quiet_NaN();

// One neuron. Thread rule: thread-compatible.
//
// Samples are in file order. The *rank* of a sample is its position in these arrays, which all have the same length.
//
// Links have one of two forms; connect() chooses. A forest has `parents`; the rank of a segment is the rank of its
// child. A graph with at least one loop has `links`; the rank of a segment is its position in `links`.
struct Cell {
  std::string source;                    // path below the folder argument, archive.zip/entry, or base name; raw bytes
  std::uint64_t digest = 0;              // XXH3 of the bytes read, and of the placement if there is one
  std::string name;                      // a given name; empty: the name follows from the source
  std::vector<std::int64_t> sample_ids;  // as in the file; may repeat only across id blocks (see block_starts)
  std::vector<Vector3d> positions_um;    // frame W, before the grid; finite, |x| <= Grid::kMaxCoordinate_um
  std::vector<std::uint32_t> parents;    // rank of the parent, kNoParent for a root; acyclic; empty for a graph
  // {rank of the child, rank of the parent}, in file order. Then {n, n} for each sample n without a link, by rank. Two
  // samples may be linked more than once. Each connected component has exactly one sample that is no link's child: its
  // root. Empty for a forest.
  std::vector<std::array<std::uint32_t, 2>> links;
  std::vector<float> radii_um;       // kUnknownRadius where the file holds no usable radius
  std::vector<std::uint16_t> types;  // SWC type codes, raw
  std::vector<std::uint32_t>
      block_starts;  // rank of the first sample of each id block after the first (W_ID_RESTART); usually empty
  std::vector<OddRadius> odd_radii;  // ascending by rank; the others are what radii_um says
  // Lines of the file, for messages: runs in which lines and ranks increase together. Empty if the format has no lines,
  // or beyond kSamplesKept runs.
  struct LineRun {
    std::uint32_t rank;
    std::uint64_t line;
  };
  std::vector<LineRun> line_runs;
  // The comment lines before the first sample, each from its `#` on, with '\n' between them. Lines beyond kMostHeader
  // bytes are left out; a last line says how many.
  std::string header;
  static constexpr std::size_t kMostHeader = 65536;
  static constexpr std::string_view kHeaderCut = " more lines of the source's header are left out)";

  std::vector<CellAttribute> attributes;  // by different names; usually empty

  std::size_t samples() const { return sample_ids.size(); }
  std::uint64_t line(std::uint32_t rank) const;  // of the file, from 1; 0: not known. O(log runs)
  void clearSamples();                           // keeps source, digest, name and attributes; clears the header
  // If an array has room for more than 2 kSamplesKept samples, empties all arrays and frees their memory. Otherwise
  // changes nothing: the next cell reuses the memory.
  static constexpr std::size_t kSamplesKept = std::size_t{1} << 16;
  void discardLarge();
  bool isGraph() const { return !links.empty(); }
  // One more than the highest segment rank. In a forest, the ranks of roots with children name no segment.
  std::size_t segmentRanks() const { return isGraph() ? links.size() : samples(); }
  // {child, parent} of a segment. Both are equal for an isolated sample, and for the root of a forest, which has no
  // segment unless it is isolated. Requires rank < segmentRanks().
  std::array<std::uint32_t, 2> ends(std::uint32_t rank) const {
    if (isGraph()) return links[rank];
    return {rank, parents[rank] == kNoParent ? rank : parents[rank]};
  }
};

// Links the samples of `cell` by undirected `edges` between ranks, in file order. Replaces `parents` and `links`: a
// forest gets `parents`, any other graph gets `links`.
//
// A breadth-first search starts from the lowest rank of each component, its root. It takes the links of a node in file
// order. The child of a link is the end reached later. In a forest, the parent is the node from which the search came.
// Requires two different ends, both below cell.samples(). O(samples + edges).
void connect(Cell& cell, std::vector<std::array<std::uint32_t, 2>> edges);

// Ids without repeats: each block after the first is shifted past the highest earlier id. If the shifted ids exceed 64
// bits, the ids are 1, 2, 3 and so on. O(samples).
std::vector<std::int64_t> distinctIds(std::vector<std::int64_t> ids, const std::vector<std::uint32_t>& block_starts);

// The input of ingest(). Thread rule: thread-compatible.
class CellStream {
 public:
  virtual ~CellStream() = default;
  // Moves the next cell into `cell`. Returns false at the end. Cells come in the order of cell ids: by source, then by
  // digest, both in byte order. Throws IoError when a listed file can no longer be read.
  virtual bool next(Cell& cell) = 0;
};

// A stream of cells in memory, in the given order. Thread rule: thread-compatible.
class CellList final : public CellStream {
 public:
  explicit CellList(std::vector<Cell> cells) : cells_(std::move(cells)) {}
  bool next(Cell& cell) override {
    if (at_ == cells_.size()) return false;
    cell = std::move(cells_[at_++]);
    return true;
  }

 private:
  std::vector<Cell> cells_;
  std::size_t at_ = 0;
};

// Returns display names of cells, in the order of cell ids. `given` is empty or as long as `sources`.
//
// The first cell with a given name gets that name. A cell without a given name is named after its source: the base name
// without its file ending and `.CNG`. Sources with equal base names get the shortest suffix of the path that is unique.
// Equal sources and names already taken get `#2`, `#3` and so on. O(total length) expected.
std::vector<std::string> cellNames(const std::vector<std::string>& sources, const std::vector<std::string>& given = {});
// True if cellNames() may have made the name from this source; then it was probably not given.
bool mayBeNamedAfter(std::string_view name, const std::string& source);

}  // namespace filiform
