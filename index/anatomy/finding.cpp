#include "index/anatomy/finding.h"

#include "index/count_text.h"

#include <algorithm>
#include <array>
#include <cstdio>

namespace filiform {
namespace {

struct KindText {
  std::string_view name, explanation, next;
};

constexpr std::array<KindText, kFindingKinds> kFindingTexts = {{
    {"long_links", "links longer than 20 times the median of the cell",
     "look at these lines; 'filiform fix --drop-long-links' takes these links out"},
    {"flat_z", "all samples have the same z", "look for the original with z; lengths in depth are lost here"},
    {"other_unit", "a size as if the unit were another than that of the folder",
     "give this file alone to ingest, with the --unit of its data"},
    {"duplicate", "samples and links equal those of an earlier input",
     "remove one of the two; otherwise the cell counts twice"},
    {"loose_trees", "trees that no link joins to the soma or to the rest",
     "leave them, or join them with 'filiform fix --join-gaps UM' or '--soma-links'"},
    {"no_soma", "no sample of type 1", "give the samples of the soma type 1, if the soma was traced"},
    {"several_somata", "several somata in one cell", "split the file if it holds several cells, or correct the types"},
    {"one_type", "one type for all neurites", "set the types: 1 soma, 2 axon, 3 basal dendrite, 4 apical dendrite"},
    {"z_scale", "z much longer or shorter than x and y",
     "compare the distance between slices with the unit of x and y"},
    {"far_axon", "an axon begins more than 100 um from the soma",
     "check the types near these lines, and whether a piece of axon is missing"},
    {"zero_length", "links between equal positions", "remove the repeated points if another program refuses them"},
    {"back_tracking", "the neurite turns back at a place without a branch",
     "look at these lines; the tracing may run over itself"},
    {"constant_radius", "one radius for all neurites", "do not use diameters, surfaces or volumes of this cell"},
    {"unknown_radius", "samples without a radius above 0",
     "do not use diameters, surfaces or volumes at these samples"},
    {"large_radius", "radii larger than the cell", "correct the radii in these lines"},
}};

static_assert(std::all_of(kFindingTexts.begin(), kFindingTexts.end(),
                          [](const KindText& t) { return !t.next.empty(); }));

}  // namespace

std::string_view name(FindingKind kind) { return kFindingTexts[static_cast<std::size_t>(kind)].name; }
std::string_view explanation(FindingKind kind) { return kFindingTexts[static_cast<std::size_t>(kind)].explanation; }
std::string_view nextStep(FindingKind kind) { return kFindingTexts[static_cast<std::size_t>(kind)].next; }

std::string placesText(const Finding& finding, std::size_t most) {
  std::string text;
  for (std::size_t i = 0; i < std::min(most, finding.places.size()); ++i) {
    const FindingPlace& place = finding.places[i];
    text += text.empty() ? "" : ", ";
    text += place.line > 0 ? "line " + std::to_string(place.line) : "sample " + std::to_string(place.sample);
    if (!(place.value_um > 0)) continue;
    std::array<char, 40> value{};
    std::snprintf(value.data(), value.size(), " (%.4g um)", place.value_um);
    text += value.data();
  }
  const std::uint64_t named = std::min<std::uint64_t>(most, finding.places.size());
  if (named > 0 && finding.count > named) text += " and " + formatCount(finding.count - named) + " more";
  return text;
}

}  // namespace filiform
