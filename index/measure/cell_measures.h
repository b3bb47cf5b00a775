// Measures one cell. MEASURES.md defines every feature. Thread rule: pure functions.
#pragma once

#include "index/measure/cell_tree.h"
#include "index/measure/measures.h"

#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

namespace filiform {

enum class MeasurePer : std::uint8_t { kCell, kType, kNeurite, kBranch };

struct MeasureOptions {
  MeasurePer per = MeasurePer::kCell;  // which parts are kept beside the whole cell
  double sholl_um = 0;                 // step of the spheres; 0: no Sholl analysis
  std::vector<std::uint16_t> types{};  // measure neurites of these types alone; empty: all
};

// The type of SWC that a word means: undefined, soma, axon, basal (dendrite), apical, or a number. nullopt: none.
std::optional<std::uint16_t> neuriteType(std::string_view word);
// The word, or the number.
std::string neuriteTypeName(std::uint16_t type);
// The words, to suggest.
std::span<const std::string_view> neuriteTypeNames();

// A part of a cell: the neurites of a type, a neurite, or a section.
struct MeasuredPart {
  std::uint16_t type = 0;                   // of the neurite
  std::uint32_t neurite = CellTree::kNone;  // position in CellTree::neurites
  std::uint32_t section = CellTree::kNone;  // position among the sections of the neurite
  std::uint32_t parent = CellTree::kNone;   // the parent section, likewise
  std::uint32_t rank = CellTree::kNone;     // of the first sample of a neurite, or the last sample of a section
  std::int64_t sample_id = 0;               // of this sample; measureCells() sets it
  Measures measures;
};

struct CellMeasures {
  SomaShape soma;
  Measures all;  // all neurites
  // kType: ascending by type. kNeurite: as in CellTree. kBranch: by neurite, depth first; a section has no extents and
  // no Sholl analysis.
  std::vector<MeasuredPart> parts;
};

// Throws UsageError if the cell needs more than kMostSpheres spheres. O(samples + spheres crossed).
inline constexpr double kMostSpheres = 1e6;
CellMeasures measuresOf(const CellTree& tree, const MeasureOptions& options = {});

}  // namespace filiform
