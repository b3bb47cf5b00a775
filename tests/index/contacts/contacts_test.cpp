// Contacts beside brute force: all pairs of segments, joined as the definition says.
#include "index/contacts/contacts.h"

#include "index/contacts/closest_places.h"
#include "index/errors.h"
#include "index/query/cell_paths.h"
#include "tests/support/sanitized.h"
#include "tests/support/scenes/memory_store.h"
#include "tests/support/scenes/random_cells.h"
#include "tests/support/what_of.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <map>
#include <memory>
#include <numeric>
#include <optional>
#include <random>
#include <set>
#include <string>
#include <tuple>

#include <gtest/gtest.h>

namespace filiform {
namespace {

using test::addSample;
using test::storeOf;

std::vector<std::uint32_t> allIds(const TileStore& store) {
  std::vector<std::uint32_t> cells(store.cell_count());
  std::iota(cells.begin(), cells.end(), 0u);
  return cells;
}

ContactOptions between(const TileStore& store, double within_um) {
  return {.within_um = within_um, .from = allIds(store), .to = allIds(store)};
}

std::vector<ContactSite> sitesOf(const TileStore& store, const ContactOptions& options,
                                 ContactCounts* counts = nullptr) {
  std::vector<ContactSite> sites;
  const ContactCounts found = findContacts(store, options, [&](const ContactSite& site) { sites.push_back(site); });
  EXPECT_EQ(found.sites, sites.size());
  if (counts != nullptr) *counts = found;
  return sites;
}

// The sites by all pairs of segments.
class AllPairs {
 public:
  AllPairs(const TileStore& store, const ContactOptions& options) : options_(options) {
    for (std::uint32_t cell = 0; cell < store.cell_count(); ++cell) {
      graphs_.push_back(readCell(store, cell, true));
      const CellGraph& graph = graphs_.back();
      const auto add = [&](std::uint32_t rank, std::uint32_t child, std::uint32_t parent) {
        const auto radius = [&](std::uint32_t sample) {
          return graph.radii_um[sample] > 0 ? double{graph.radii_um[sample]} : 0.0;
        };
        Segment s{cell, rank, child, parent, graph.types[child], {graph.position_W(child), graph.position_W(parent)}};
        if (options.surface) s.ends.child_radius_um = radius(child), s.ends.parent_radius_um = radius(parent);
        segments_.push_back(s);
      };
      if (graph.isGraph()) {
        for (std::uint32_t i = 0; i < graph.links.size(); ++i) add(i, graph.links[i][0], graph.links[i][1]);
      } else {
        std::set<std::uint32_t> with_children(graph.parents.begin(), graph.parents.end());
        for (std::uint32_t i = 0; i < graph.samples(); ++i) {
          if (graph.parents[i] != kNoParent)
            add(i, i, graph.parents[i]);
          else if (!with_children.contains(i))
            add(i, i, i);
        }
      }
    }
  }

  std::vector<ContactSite> sites() {
    const bool alike = options_.from == options_.to && options_.from_types == options_.to_types;
    std::map<std::array<std::uint32_t, 2>, std::vector<Pair>> by_cells;
    for (std::size_t i = 0; i < segments_.size(); ++i)
      for (std::size_t j = i + 1; j < segments_.size(); ++j) {
        const Segment &a = segments_[i], &b = segments_[j];
        if (a.cell == b.cell || isFar(a, b)) continue;
        const ClosestPlaces p = options_.surface ? closestOnSurfaces(a.ends, b.ends) : closestOnAxes(a.ends, b.ends);
        if (!(p.distance_um <= options_.within_um)) continue;
        const bool forth = is(a, options_.from, options_.from_types) && is(b, options_.to, options_.to_types);
        const bool back = is(b, options_.from, options_.from_types) && is(a, options_.to, options_.to_types);
        if (forth) by_cells[{a.cell, b.cell}].push_back({&a, &b, p.distance_um, p.t[0], p.t[1]});
        if (back && !(alike && forth)) by_cells[{b.cell, a.cell}].push_back({&b, &a, p.distance_um, p.t[1], p.t[0]});
      }
    std::vector<ContactSite> sites;
    for (auto& [cells, pairs] : by_cells) addSites(pairs, sites);
    return sites;
  }
  std::size_t segments() const { return segments_.size(); }

 private:
  struct Segment {
    std::uint32_t cell, rank, child, parent;
    std::uint16_t type;
    SegmentEnds ends;
  };
  struct Pair {
    const Segment *a, *b;
    double distance_um, t, u;
    auto key() const { return std::tie(a->rank, b->rank); }
  };
  static bool has(const auto& values, auto value) {
    return std::find(values.begin(), values.end(), value) != values.end();
  }
  static bool is(const Segment& s, const std::vector<std::uint32_t>& cells, const std::vector<std::uint16_t>& types) {
    return has(cells, s.cell) && (types.empty() || has(types, s.type));
  }
  bool isFar(const Segment& a, const Segment& b) const {
    const double more = options_.within_um + 0.01 + std::max(a.ends.child_radius_um, a.ends.parent_radius_um) +
                        std::max(b.ends.child_radius_um, b.ends.parent_radius_um);
    for (int i = 0; i < 3; ++i) {
      const auto [alo, ahi] = std::minmax(a.ends.child_W[i], a.ends.parent_W[i]);
      const auto [blo, bhi] = std::minmax(b.ends.child_W[i], b.ends.parent_W[i]);
      if (alo - bhi > more || blo - ahi > more) return true;
    }
    return false;
  }
  static bool touch(const Segment& s, const Segment& t) {
    return s.rank == t.rank || s.child == t.child || s.child == t.parent || s.parent == t.child || s.parent == t.parent;
  }
  void addSites(std::vector<Pair>& pairs, std::vector<ContactSite>& sites) {
    std::sort(pairs.begin(), pairs.end(), [](const Pair& p, const Pair& q) { return p.key() < q.key(); });
    std::vector<bool> taken(pairs.size());
    for (std::size_t first = 0; first < pairs.size(); ++first) {
      if (taken[first]) continue;
      std::vector<std::size_t> site{first};
      taken[first] = true;
      for (std::size_t at = 0; at < site.size(); ++at)
        for (std::size_t i = 0; i < pairs.size(); ++i)
          if (!taken[i] && touch(*pairs[site[at]].a, *pairs[i].a) && touch(*pairs[site[at]].b, *pairs[i].b)) {
            taken[i] = true;
            site.push_back(i);
          }
      std::sort(site.begin(), site.end());
      addSite(pairs, site, sites);
    }
  }
  void addSite(const std::vector<Pair>& pairs, const std::vector<std::size_t>& members,
               std::vector<ContactSite>& sites) {
    const Pair* best = &pairs[members[0]];
    std::array<std::map<std::uint32_t, const Segment*>, 2> parts;
    for (const std::size_t i : members) {
      if (pairs[i].distance_um < best->distance_um) best = &pairs[i];
      parts[0][pairs[i].a->rank] = pairs[i].a;
      parts[1][pairs[i].b->rank] = pairs[i].b;
    }
    ContactSite& site = sites.emplace_back();
    site.pairs = members.size();
    site.distance_um = best->distance_um;
    for (const std::size_t side : {0, 1}) {
      const Segment& s = side == 0 ? *best->a : *best->b;
      const CellGraph& graph = graphs_[s.cell];
      const double t = side == 0 ? best->t : best->u;
      ContactSite::Side& to = site.sides[side];
      to = {s.cell, s.rank, s.child, s.parent, s.type, t};
      for (const auto& [rank, part] : parts[side]) to.length_um += (part->ends.parent_W - part->ends.child_W).norm();
      to.p_W = s.ends.at(t);
      to.sample_id = graph.sample_ids[s.child];
      to.path_um = NAN;
      const auto soma = std::find(graph.types.begin(), graph.types.end(), std::uint16_t{1});
      if (soma == graph.types.end()) continue;
      const CellPaths& paths = *paths_.try_emplace(s.cell, graph).first->second.paths;
      const auto source = paths.at(static_cast<std::uint32_t>(soma - graph.types.begin()));
      const std::vector<double> lengths = paths.lengths_um(source);
      const double length = (s.ends.parent_W - s.ends.child_W).norm();
      const double path = std::min(lengths[s.child] + t * length, lengths[s.parent] + (1 - t) * length);
      if (std::isfinite(path)) to.path_um = path;
    }
  }

  struct Paths {
    explicit Paths(const CellGraph& graph) : paths(std::make_unique<CellPaths>(graph)) {}
    std::unique_ptr<CellPaths> paths;
  };
  const ContactOptions options_;
  std::vector<CellGraph> graphs_;
  std::vector<Segment> segments_;
  std::map<std::uint32_t, Paths> paths_;
};

auto sideBits(const ContactSite::Side& s) {
  const auto bits = [](double value) { return std::isnan(value) ? 0 : std::bit_cast<std::uint64_t>(value + 0.0); };
  return std::tuple(s.cell, s.segment, s.child, s.parent, s.type, s.sample_id, bits(s.t), bits(s.length_um),
                    bits(s.path_um), bits(s.p_W[0]), bits(s.p_W[1]), bits(s.p_W[2]));
}

void expectSameSites(const std::vector<ContactSite>& a, const std::vector<ContactSite>& b) {
  ASSERT_EQ(a.size(), b.size());
  for (std::size_t i = 0; i < a.size(); ++i) {
    ASSERT_EQ(sideBits(a[i].sides[0]), sideBits(b[i].sides[0])) << i;
    ASSERT_EQ(sideBits(a[i].sides[1]), sideBits(b[i].sides[1])) << i;
    ASSERT_EQ(a[i].distance_um, b[i].distance_um) << i;
    ASSERT_EQ(a[i].pairs, b[i].pairs) << i;
  }
}

// Cells on whole numbers, so that many places are equally close, with types, unknown radii, and forests.
std::vector<Cell> latticeCells(std::uint64_t seed, std::uint32_t cells, std::uint32_t samples, int extent) {
  std::mt19937_64 random(seed);
  std::vector<Cell> all;
  for (std::uint32_t c = 0; c < cells; ++c) {
    Cell& cell = all.emplace_back();
    cell.source = "lattice" + std::to_string(c);
    for (std::uint32_t i = 0; i < samples; ++i) {
      const float radius_um = random() % 5 == 0 ? kUnknownRadius : static_cast<float>(random() % 8) / 8 + 0.125f;
      const auto type = static_cast<std::uint16_t>(i == 0 && c % 3 != 0 ? 1 : 2 + random() % 3);
      const auto somewhere = [&] {
        const auto whole = [&] { return static_cast<double>(random() % static_cast<std::uint64_t>(extent)); };
        const double x = whole(), y = whole();
        return Vector3d(x, y, whole());
      };
      if (i == 0 || random() % 40 == 0) {
        addSample(cell, somewhere(), kNoParent, radius_um, type);
        continue;
      }
      const std::uint32_t parent = random() % 8 == 0 ? static_cast<std::uint32_t>(random() % i) : i - 1;
      Vector3d p = cell.positions_um[parent];
      p[static_cast<int>(random() % 3)] += static_cast<double>(random() % 5) - 2;
      addSample(cell, p, parent, radius_um, type);
    }
  }
  return all;
}

// The same with loops in every second cell.
std::vector<Cell> withLoops(std::vector<Cell> cells, std::uint64_t seed) {
  std::mt19937_64 random(seed);
  for (std::size_t c = 0; c < cells.size(); c += 2) {
    std::vector<std::array<std::uint32_t, 2>> edges;
    const auto samples = static_cast<std::uint32_t>(cells[c].samples());
    for (std::uint32_t i = 0; i < samples; ++i)
      if (cells[c].parents[i] != kNoParent) edges.push_back({i, cells[c].parents[i]});
    for (std::uint32_t i = 0; i + 3 < samples; i += 17)
      edges.push_back({i, i + 1 + static_cast<std::uint32_t>(random() % 2)});
    connect(cells[c], std::move(edges));
  }
  return cells;
}

std::vector<Cell> oddCells(std::uint64_t seed) {
  std::vector<Cell> cells = withLoops(latticeCells(seed, 8, 250, 25), seed + 1);
  for (Cell& cell : test::randomColumn(seed + 2, 5, 300, 25)) cells.push_back(std::move(cell));
  for (std::size_t i = 0; i < cells.size(); ++i) cells[i].source = std::string(1, static_cast<char>('a' + i));
  return cells;
}

TEST(Contacts, EqualBruteForceOnTwentyThousandSegments) {
  const std::uint64_t seed = 5301;
  SCOPED_TRACE(seed);
  const auto cells = static_cast<std::uint32_t>(test::sampled(20));
  const auto store = storeOf(test::randomColumn(seed, cells, 1000, 50), 256);
  for (const bool surface : {false, true}) {
    ContactOptions options = between(*store, test::kSanitized ? 12 : 1.5);  // fewer cells: more of their contacts
    options.surface = surface;
    options.threads = 2;
    AllPairs all(*store, options);
    EXPECT_GT(all.segments(), 950 * cells);
    const std::vector<ContactSite> sites = sitesOf(*store, options);
    EXPECT_GT(sites.size(), test::kSanitized ? 15U : 100U);
    expectSameSites(sites, all.sites());
  }
}

TEST(Contacts, EqualBruteForceWithTiesLoopsForestsAndUnknownRadii) {
  std::uint64_t cases = 0;
  for (const std::uint64_t seed : {5302, 5303}) {
    SCOPED_TRACE(seed);
    const std::vector<Cell> cells = oddCells(seed);
    for (const std::uint32_t capacity : {12u, 100u}) {
      const auto store = storeOf(cells, capacity);
      for (const bool surface : {false, true})
        for (const double within_um : {0.25, 1.0, 2.0}) {
          if (test::kSanitized && cases++ % 5 != 0) continue;
          ContactOptions options = between(*store, within_um);
          options.surface = surface;
          expectSameSites(sitesOf(*store, options), AllPairs(*store, options).sites());
        }
    }
  }
}

TEST(Contacts, EqualBruteForceBetweenSomeCellsAndTypes) {
  const std::uint64_t seed = 5304;
  SCOPED_TRACE(seed);
  const auto store = storeOf(oddCells(seed), 25);
  const std::vector<std::uint32_t> one{3}, some{0, 2, 3, 7, 9}, others{1, 4, 11}, none{};
  const std::vector<std::uint16_t> axon{2}, dendrites{3, 4}, any{};
  std::uint64_t cases = 0;
  for (const auto& from : {one, some, allIds(*store), none})
    for (const auto& to : {others, some, allIds(*store)})
      for (const auto& [from_types, to_types] : {std::pair(axon, dendrites), std::pair(any, any), std::pair(any, axon)})
        for (const bool surface : {false, true}) {
          if (test::kSanitized && cases++ % 5 != 0) continue;
          const ContactOptions options{.within_um = 1,
                                       .surface = surface,
                                       .from = from,
                                       .to = to,
                                       .from_types = from_types,
                                       .to_types = to_types};
          expectSameSites(sitesOf(*store, options), AllPairs(*store, options).sites());
        }
}

TEST(Contacts, EqualBruteForceOnExtremeCells) {
  for (test::NamedCells& named : test::worstCases()) {
    if (named.name == "one voxel") continue;  // everything touches
    SCOPED_TRACE(named.name);
    // A second neuron through the first, and one apart.
    Cell through = test::randomNeuron(5305, {.samples = 200, .step_um = 6}),
         apart = test::randomNeuron(5306, {.samples = 50});
    for (Vector3d& p : apart.positions_um) p += Vector3d(3e4, 0, 0);
    through.source = "x", apart.source = "y";
    named.cells.push_back(through);
    named.cells.push_back(apart);
    const auto store = storeOf(named.cells, 20);
    for (const bool surface : {false, true}) {
      ContactOptions options = between(*store, 2);
      options.surface = surface;
      expectSameSites(sitesOf(*store, options), AllPairs(*store, options).sites());
      options.from = {static_cast<std::uint32_t>(store->cell_count() - 2)};
      expectSameSites(sitesOf(*store, options), AllPairs(*store, options).sites());
    }
  }
}

TEST(Contacts, ThreadsMemoryAndTilingDoNotChangeThem) {
  const std::uint64_t seed = 5307;
  SCOPED_TRACE(seed);
  const std::vector<Cell> cells = oddCells(seed);
  for (const bool surface : {false, true}) {
    const auto whole = storeOf(cells, 100'000);
    ContactOptions options = between(*whole, 1);
    options.surface = surface;
    const std::vector<ContactSite> expected = sitesOf(*whole, options);
    ASSERT_GT(expected.size(), 100u);
    for (const std::uint32_t capacity : {10u, 64u}) {
      const auto store = storeOf(cells, capacity);
      for (const unsigned threads : {1u, 2u, 3u})
        for (const std::uint64_t memory : {std::uint64_t{1} << 16, std::uint64_t{1} << 28}) {
          options.threads = threads;
          options.memory_bytes = memory;
          ContactCounts counts;
          expectSameSites(sitesOf(*store, options, &counts), expected);
          EXPECT_EQ(counts.file_bytes > 0, memory < 1 << 20) << "small memory: pairs go to a file";
          EXPECT_EQ(counts.unknown_radii > 0, surface);
        }
    }
  }
}

TEST(Contacts, ManyPairsOfTwoCellsPassThroughTheFile) {
  const std::uint64_t seed = 5311;
  SCOPED_TRACE(seed);
  const auto store = storeOf(latticeCells(seed, 4, 300, 6), 100);
  ContactOptions options = between(*store, 5);
  ContactCounts counts;
  const std::vector<ContactSite> expected = sitesOf(*store, options, &counts);
  EXPECT_GT(counts.pairs, 50'000u);
  EXPECT_EQ(counts.file_bytes, 0u);
  options.memory_bytes = 1 << 16;
  expectSameSites(sitesOf(*store, options, &counts), expected);
  EXPECT_GT(counts.file_bytes, std::uint64_t{1} << 20);

  const auto dense = storeOf(latticeCells(seed, 2, 600, 4), 100);
  options = between(*dense, 10);
  options.memory_bytes = 1 << 16;
  const std::string what = test::whatOf<InputError>([&] { findContacts(*dense, options, [](const ContactSite&) {}); });
  EXPECT_NE(what.find("cells 0 and 1 have more than 65 536 pairs"), std::string::npos) << what;
}

TEST(Contacts, LessDetailGivesTheSameSites) {
  for (const std::uint64_t memory_bytes : {1ULL << 16, 1ULL << 30}) {
    const auto store = storeOf(latticeCells(5308, 12, 300, 6), 50);
    ContactOptions options = between(*store, 1);
    options.memory_bytes = memory_bytes;
    const std::vector<ContactSite> all = sitesOf(*store, options);
    options.detail = ContactOptions::Detail::kSites;
    const std::vector<ContactSite> sites = sitesOf(*store, options);
    options.detail = ContactOptions::Detail::kCounts;
    const std::vector<ContactSite> counted = sitesOf(*store, options);
    ASSERT_EQ(all.size(), sites.size());
    ASSERT_EQ(all.size(), counted.size());
    for (std::size_t i = 0; i < all.size(); ++i) {
      EXPECT_EQ(all[i].sides[0].segment, sites[i].sides[0].segment);
      EXPECT_EQ(all[i].distance_um, sites[i].distance_um);
      EXPECT_EQ(all[i].pairs, counted[i].pairs);
      for (const std::size_t side : {0, 1}) EXPECT_EQ(all[i].sides[side].cell, counted[i].sides[side].cell);
    }
  }
}

TEST(Contacts, ADistanceThatMeansNothingIsRefused) {
  const auto store = storeOf(test::randomColumn(5309, 3, 100, 50), 50);
  const auto take = [](const ContactSite&) { FAIL(); };
  for (const double within_um : {0.0, -1.0, std::nan(""), HUGE_VAL})
    EXPECT_THROW(findContacts(*store, between(*store, within_um), take), UsageError);
  std::array<std::uint64_t, 3> segments{};
  for (std::uint32_t cell = 0; cell < 3; ++cell)
    segments[cell] = store->cell(cell).segments + store->cell(cell).isolated;
  const std::uint64_t pairs = segments[0] * segments[1] + segments[0] * segments[2] + segments[1] * segments[2];
  const std::string what = test::whatOf<UsageError>([&] { findContacts(*store, between(*store, 1e6), take); });
  std::string digits;
  for (const char c : what.substr(what.find("up to every") + 1))
    if (c != ' ' || digits.empty()) digits += c;
  EXPECT_NE(what.find("pairs; give a smaller distance"), std::string::npos) << what;
  EXPECT_NE(digits.find(std::to_string(pairs)), std::string::npos) << what;
}

TEST(Contacts, TheCheckEndsThem) {
  const auto store = storeOf(test::randomColumn(5310, 5, 300, 50), 20);
  for (const std::uint64_t calls : {0, 7}) {
    ContactOptions options = between(*store, 2);
    options.threads = 2;
    std::uint64_t called = 0;
    options.check = [&](std::uint64_t done, std::uint64_t tiles) {
      EXPECT_LE(done, tiles);
      if (called++ == calls) throw Interrupted("enough");
    };
    EXPECT_THROW(findContacts(*store, options, [](const ContactSite&) {}), Interrupted);
  }
}

}  // namespace
}  // namespace filiform
