// bench contacts: CPU time of findContacts() a pair, and small sets against all pairs of segments.
#include "index/contacts/closest_places.h"
#include "index/contacts/contacts.h"
#include "index/ingest/ingest.h"
#include "index/query/segment_pass.h"
#include "index/set/tile_set.h"
#include "tools/lab/bench/workloads.h"
#include "tools/synthetic/synthetic.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <numeric>
#include <string>
#include <utility>
#include <vector>

namespace filiform::tools {

namespace {

constexpr double kWithin_um = 2;
constexpr std::uint64_t kMostForAllPairs = 500'000;  // segments
constexpr std::uint16_t kAxon = 2, kBasal = 3, kApical = 4;

struct NearCells {
  std::uint64_t pairs = 0;
  double distance_um = HUGE_VAL;  // the least
  bool operator==(const NearCells&) const = default;
  void add(std::uint64_t more, double other_um) { pairs += more, distance_um = std::min(distance_um, other_um); }
};
using NearByCells = std::map<std::array<std::uint32_t, 2>, NearCells>;

NearByCells byAllPairs(const TileSet& set) {
  struct Segment {
    std::uint32_t cell;
    filiform::SegmentEnds ends;
    std::array<float, 3> middle, half;
  };
  std::array<std::vector<Segment>, 2> sides;
  forEachSegment(set, {.with_appearance = true}, [&](TileId, std::span<const PassedSegment> segments) {
    for (const PassedSegment& s : segments) {
      if (s.type != kAxon && s.type != kBasal && s.type != kApical) continue;
      Segment& to = sides[s.type == kAxon ? 0 : 1].emplace_back();
      to.cell = s.id.cell;
      to.ends = {set.grid().toWorld(s.child), set.grid().toWorld(s.parent)};
      for (int axis = 0; axis < 3; ++axis) {
        const auto at = static_cast<std::size_t>(axis);
        to.middle[at] = static_cast<float>((to.ends.child_W[axis] + to.ends.parent_W[axis]) / 2);
        to.half[at] = static_cast<float>(std::abs(to.ends.child_W[axis] - to.ends.parent_W[axis]) / 2 + 0.01);
      }
    }
  });
  NearByCells near;
  for (const Segment& a : sides[0])
    for (const Segment& b : sides[1]) {
      const auto apart = [&](std::size_t axis) {
        return std::abs(a.middle[axis] - b.middle[axis]) > static_cast<float>(kWithin_um) + a.half[axis] + b.half[axis];
      };
      if (apart(0) || apart(1) || apart(2) || a.cell == b.cell) continue;
      const bool is_lower = a.cell < b.cell;
      const double distance_um = closestOnAxes((is_lower ? a : b).ends, (is_lower ? b : a).ends).distance_um;
      if (distance_um <= kWithin_um) near[{a.cell, b.cell}].add(1, distance_um);
    }
  return near;
}

BenchReport runContacts(const BenchOptions& options) {
  const WorkFolder folder(options.out, "contacts");
  std::string path = options.scene;
  if (path.empty()) {
    path = folder.path() + "/set.fil";
    SyntheticOptions column;
    const double segments = options.quick ? 2e4 : options.segments > 0 ? static_cast<double>(options.segments) : 3e5;
    column.cells = static_cast<std::uint32_t>(std::max(2.0, segments / kSegmentsPerCell));
    column.seed = options.seed;
    SyntheticCells cells(column);
    ingest(cells, path, {});
  }
  const auto set = TileSet::open(path);
  ContactOptions contacts{.within_um = kWithin_um, .from_types = {kAxon}, .to_types = {kBasal, kApical}, .threads = 2};
  contacts.from.resize(set->cell_count());
  std::iota(contacts.from.begin(), contacts.from.end(), 0u);
  contacts.to = contacts.from;

  BenchReport report;
  BenchTable table{"contacts",
                   "Axon to dendrite within 2 um, two threads, 1 GiB; CPU time",
                   {"what", "pairs", "sites", "decode_once_s", "cpu_s", "us a pair beyond decoding twice", "peak_MiB"},
                   {}};
  const auto decode = [&] {
    for (TileId tile = 0; tile < set->tile_count(); ++tile) set->load(tile), set->loadAppearance(tile);
    return std::vector<double>{};
  };
  decode();  // reads the files
  for (const bool with_places : {true, false}) {
    contacts.detail = with_places ? ContactOptions::Detail::kPlaces : ContactOptions::Detail::kCounts;
    options.progress(with_places ? "contact sites with places" : "contact sites without places");
    const double once_s = measureInChild(decode).cpu_s;
    const ChildCost cost = measureInChild([&] {
      const ContactCounts counts = findContacts(*set, contacts, [](const ContactSite&) {});
      return std::vector<double>{static_cast<double>(counts.pairs), static_cast<double>(counts.sites)};
    });
    const double pairs = cost.numbers[0];
    table.rows.push_back({std::string(with_places ? "with places and paths" : "without, as for --matrix"), pairs,
                          cost.numbers[1], once_s, cost.cpu_s, 1e6 * (cost.cpu_s - 2 * once_s) / pairs,
                          static_cast<double>(cost.peak_bytes) / static_cast<double>(kMiB)});
  }
  report.notes.push_back(std::to_string(set->cell_count()) + " cells, " + std::to_string(set->segmentCount()) +
                         " segments, " + std::to_string(set->tile_count()) + " tiles");
  report.tables.push_back(std::move(table));
  if (set->segmentCount() > kMostForAllPairs) return report;

  options.progress("all pairs of segments");
  const ChildCost all = measureInChild([&] {
    const NearByCells expected = byAllPairs(*set);
    NearByCells found;
    findContacts(*set, contacts, [&](const ContactSite& site) {
      found[{site.sides[0].cell, site.sides[1].cell}].add(site.pairs, site.distance_um);
    });
    return std::vector<double>{found == expected ? 1.0 : 0.0, static_cast<double>(expected.size())};
  });
  report.notes.push_back("All pairs of segments took " + shown(all.cpu_s) + " s of CPU time");
  report.goals.push_back({"pairs and least distance of each two cells equal those of all pairs (1: yes)", "1", "1",
                          all.numbers[0], all.numbers[0] == 1, all.numbers[0] == 1});
  return report;
}

}  // namespace

void addContactsWorkloads(std::vector<Workload>& all) {
  all.push_back({"contacts", "contacts between cells a pair of segments, and against all pairs", runContacts});
}

}  // namespace filiform::tools
