// A cell: one neuron as it was read, and the stream of cells that readers hand to the tiler. It is the only door into a
// tile set: SWC files, archive entries, synthetic columns and other graphs all come through it.
#pragma once

#include "index/grid.h"

#include <array>
#include <cstdint>
#include <limits>
#include <string>
#include <utility>
#include <vector>

namespace filiform {

inline constexpr std::uint32_t kNoParent = UINT32_MAX;
inline constexpr float kUnknownRadius = std::numeric_limits<float>::quiet_NaN();

// Thread-compatible. Samples are in file order; a sample's *rank* is its place in these arrays, all of the same length.
//
// Links come in one of two forms. A forest has `parents`, and a segment is named by the rank of its child. A graph with
// at least one loop has `links` instead, and a segment is named by its place there. connect() chooses.
struct Cell {
  std::string source;                    // path below the folder argument, archive.zip/entry, or base name; raw bytes
  std::uint64_t digest = 0;              // XXH3 of the bytes it was read from, and of where it was placed
  std::string name;                      // that was given to it; empty: from the source
  std::vector<std::int64_t> sample_ids;  // as in the file; may repeat only across id blocks (see block_starts)
  std::vector<Vector3d> positions_um;    // frame W, before the grid; finite, |x| <= Grid::kMaxCoordinate_um
  std::vector<std::uint32_t> parents;  // rank of the parent, kNoParent for a root; acyclic; empty where `links` is not
  // {rank of the child, rank of the parent}, in file order, then {n, n} for each sample n without any link, by rank.
  // Two samples may be linked more than once, none to itself otherwise. Of each connected component exactly one sample,
  // its root, is no link's child. There are more links than a forest has. Empty for a forest.
  std::vector<std::array<std::uint32_t, 2>> links;
  std::vector<float> radii_um;       // kUnknownRadius where the file held no usable one
  std::vector<std::uint16_t> types;  // SWC type codes, raw
  std::vector<std::uint32_t>
      block_starts;  // rank of the first sample of each further id block (W_ID_RESTART); empty as a rule

  std::size_t samples() const { return sample_ids.size(); }
  void clearSamples();  // leaves source, digest and name
  // Empties all arrays and frees their memory if one has room for more than 2 kSamplesKept samples. Smaller arrays are
  // left as they are: the next cell uses their memory again.
  static constexpr std::size_t kSamplesKept = std::size_t{1} << 16;
  void discardLarge();
  bool isGraph() const { return !links.empty(); }
  // Ranks of segments, those of isolated samples included, lie below this; in a forest, roots leave gaps.
  std::size_t segmentRanks() const { return isGraph() ? links.size() : samples(); }
  // {child, parent} of the segment of that rank; both the same where it stands for an isolated sample, and for the root
  // of a forest, which has no segment unless it is isolated. Requires rank < segmentRanks().
  std::array<std::uint32_t, 2> ends(std::uint32_t rank) const {
    if (isGraph()) return links[rank];
    return {rank, parents[rank] == kNoParent ? rank : parents[rank]};
  }
};

// Links the samples of `cell` by undirected `edges` between ranks, in file order: as a forest where they are one,
// otherwise as `links`. A breadth-first search from the lowest rank of each component, its root, takes the links of a
// node in file order; each link's child is the end that was reached later, and a forest's parents are those the search
// came from. Requires ends below cell.samples() and different. Replaces `parents` and `links`. O(samples + edges).
void connect(Cell& cell, std::vector<std::array<std::uint32_t, 2>> edges);

class CellStream {
 public:
  virtual ~CellStream() = default;
  // Moves the next cell into `cell`, in the order that gives cell ids (source, then digest, in byte order). False at
  // the end. Throws IoError when a file that was listed can no longer be read.
  virtual bool next(Cell& cell) = 0;
};

// Cells that are in memory, in the order given. Thread-compatible.
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

// Names of cells for people, in the order of cell ids. `given` is empty or as long as `sources`. A given name goes to
// the first that asks for it. Otherwise from the source: its base name without the ending and `.CNG`; where these are
// equal, the shortest suffix of the source path that tells them apart. `#2`, `#3` for equal sources and names that are
// taken. O(total length) expected.
std::vector<std::string> cellNames(const std::vector<std::string>& sources, const std::vector<std::string>& given = {});

}  // namespace filiform
