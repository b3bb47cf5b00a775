// What a biologist would doubt or note about a cell: the kinds, their names, and what to do next.
//
// A doubt means that the cell is probably not what its author drew. A note states a property that matters for some
// measures. Neither changes what is kept. Thread rule: values, pure functions.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

namespace filiform {

// In printing order.
enum class FindingKind : std::uint8_t {
  kLongLinks,       // links longer than 20 times the median; a doubt only if long or many (AnatomyCheck)
  kFlatZ,           // all samples have one z; a doubt only if the cell is long in x and y
  kOtherUnit,       // a size that differs from the other cells of the folder as if the unit were another; a doubt
  kDuplicate,       // the samples and links of an earlier input; a doubt
  kLooseTrees,      // trees that no link joins to the rest, or to the soma if there is one
  kNoSoma,          // no sample of type 1
  kSeveralSomata,   // groups of linked samples of type 1: more than one
  kOneType,         // one type for all samples, or only type 0 beside the soma
  kZScale,          // z much longer or much shorter than x and y
  kFarAxon,         // an axon that begins more than 100 um from the soma
  kZeroLength,      // links between equal positions
  kBackTracking,    // unbranched places where the neurite turns back by more than 154 degrees
  kConstantRadius,  // one radius for all samples beside the soma
  kNoRadius,        // samples whose radius is unknown or 0
  kLargeRadius,     // radii larger than the longest side of the cell's box
};
inline constexpr std::size_t kFindingKinds = static_cast<std::size_t>(FindingKind::kLargeRadius) + 1;

std::string_view name(FindingKind kind);  // "long_links"
// What to do, as a sentence without its full stop.
std::string_view nextStep(FindingKind kind);
// What the kind means, for a table of counts.
std::string_view explanation(FindingKind kind);

struct FindingPlace {
  std::uint64_t line = 0;   // of the file, from 1; 0: not known
  std::int64_t sample = 0;  // id, as in the file
  double value_um = 0;      // length, distance or radius; 0: none
};

struct Finding {
  static constexpr std::size_t kMostPlaces = 20;

  FindingKind kind{};
  bool doubt = false;
  std::uint64_t count = 0;           // of links, trees, samples; 0: the whole cell
  std::vector<FindingPlace> places;  // at most kMostPlaces: the largest values first, else in file order
  std::string text;                  // what was found, with numbers; may hold names from files, as raw bytes
};

// "line 57 (589.2 um), line 60 (12 um)": at most `most` places, then "and N more". A place without a line is named by
// its sample. Empty without places.
std::string placesText(const Finding& finding, std::size_t most);

}  // namespace filiform
