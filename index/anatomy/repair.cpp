#include "index/anatomy/repair.h"

#include "index/anatomy/anatomy_check.h"
#include "index/cell/soma.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numeric>
#include <tuple>
#include <unordered_map>
#include <utility>

namespace filiform {
namespace {

using ChangeKind = RepairChange::Kind;

constexpr int kMostRepairRounds = 16;  // of all repairs: one can make another possible
constexpr int kMostDrops = 100;        // rounds; dropped links lower the median
constexpr std::size_t kMostSoma = 64;  // samples that roots are compared with

// Trees of a forest: the root of each sample.
std::vector<std::uint32_t> rootsOf(const Cell& cell) {
  std::vector<std::uint32_t> root(cell.samples(), kNoParent), walk;
  for (std::uint32_t rank = 0; rank < cell.samples(); ++rank) {
    std::uint32_t at = rank;
    for (; root[at] == kNoParent && cell.parents[at] != kNoParent; at = cell.parents[at]) walk.push_back(at);
    const std::uint32_t its = root[at] == kNoParent ? at : root[at];
    root[at] = its;
    for (const std::uint32_t on : walk) root[on] = its;
    walk.clear();
  }
  return root;
}

std::vector<bool> treesWithSoma(const Cell& cell, const std::vector<std::uint32_t>& root) {
  std::vector<bool> has_soma(cell.samples());
  for (std::uint32_t rank = 0; rank < cell.samples(); ++rank)
    if (cell.types[rank] == kSomaType) has_soma[root[rank]] = true;
  return has_soma;
}

class Repair {
 public:
  Repair(Cell& cell, const RepairOptions& options) : cell_(cell), options_(options) {}

  std::vector<RepairChange> run() {
    setRadii();
    for (int round = 0; round < kMostRepairRounds; ++round) {
      const std::size_t before = changes_.size();
      if (options_.drop_long_links) dropLongLinks();
      if (options_.join_gaps_um > 0) joinGaps();
      if (options_.soma_links) linkSomata();
      if (changes_.size() == before) break;
    }
    cutHeader();
    renumber();
    orderParentsFirst();
    return std::move(changes_);
  }

 private:
  void note(ChangeKind kind, std::uint32_t rank, std::int64_t other, double value) {
    changes_.push_back({kind, cell_.line(rank), cell_.sample_ids[rank], other, value});
  }

  void dropLongLinks() {
    AnatomyCheck check;
    for (int round = 0; round < kMostDrops; ++round) {
      const std::vector<Finding>& findings = check.of(cell_);
      if (check.median_um() > 0) most_um_ = AnatomyCheck::kLongLink * check.median_um();
      if (std::none_of(findings.begin(), findings.end(),
                       [](const Finding& f) { return f.kind == FindingKind::kLongLinks && f.doubt; }))
        return;
      for (const std::uint32_t rank : check.longLinks()) {
        const std::uint32_t parent = std::exchange(cell_.parents[rank], kNoParent);
        note(ChangeKind::kLinkDropped, rank, cell_.sample_ids[parent],
             (cell_.positions_um[rank] - cell_.positions_um[parent]).norm());
      }
    }
  }

  // Makes `rank` the root of its tree.
  void turnRound(std::uint32_t rank) {
    std::uint64_t links = 0;
    std::uint32_t at = rank, new_parent = kNoParent;
    while (at != kNoParent) {
      const std::uint32_t next = std::exchange(cell_.parents[at], new_parent);
      new_parent = std::exchange(at, next);
      ++links;
    }
    if (links > 1) note(ChangeKind::kTurnedRound, new_parent, cell_.sample_ids[rank], static_cast<double>(links - 1));
  }

  struct Candidate {
    double um;
    std::uint32_t end, other;
  };

  void joinGaps() {
    for (bool joined = true; joined;) {
      joined = false;
      const std::vector<std::uint32_t> root = rootsOf(cell_);
      std::vector<bool> has_soma = treesWithSoma(cell_, root);
      std::vector<std::uint32_t> set(root.size());  // of roots: a tree that it was joined to
      std::iota(set.begin(), set.end(), 0u);
      const auto find = [&set](std::uint32_t at) {
        while (set[at] != at) at = set[at] = set[set[at]];
        return at;
      };
      for (const auto& [um, end, other] : candidates(root, has_soma)) {
        const std::uint32_t a = find(root[end]), b = find(root[other]);
        if (a == b || (has_soma[a] && has_soma[b])) continue;
        // The tree with a soma keeps its root.
        const std::uint32_t child = has_soma[a] ? other : end, parent = has_soma[a] ? end : other;
        turnRound(child);
        cell_.parents[child] = parent;
        note(ChangeKind::kGapJoined, child, cell_.sample_ids[parent], um);
        set[a] = b;
        has_soma[b] = has_soma[a] || has_soma[b];
        joined = true;
      }
    }
  }

  // For each root and tip, the nearest sample of another tree within the gap, in ascending order of the distance.
  std::vector<Candidate> candidates(const std::vector<std::uint32_t>& root, const std::vector<bool>& has_soma) const {
    std::vector<Candidate> found;
    if (std::all_of(root.begin(), root.end(), [&](std::uint32_t r) { return r == root.front(); })) return found;
    constexpr int kReach = 4;  // boxes on each side
    const double gap_um = std::min(options_.join_gaps_um, most_um_);
    const double edge_um = std::max(gap_um, RepairOptions::kLeastGap_um) / kReach;
    using Box = std::array<std::int64_t, 3>;
    const auto box_of = [edge_um](const Vector3d& p) {
      Box box{};
      for (std::size_t axis = 0; axis < 3; ++axis)
        box[axis] = static_cast<std::int64_t>(std::floor(p[static_cast<Eigen::Index>(axis)] / edge_um));
      return box;
    };
    const auto key_of = [](const Box& box) {
      std::uint64_t key = 0;
      for (const std::int64_t at : box) key = (key ^ static_cast<std::uint64_t>(at)) * 0x9E3779B97F4A7C15u;
      return key ^ key >> 29;
    };
    std::unordered_map<std::uint64_t, std::uint32_t> first;  // by box: a list through `next`
    std::vector<std::uint32_t> next(root.size(), kNoParent);
    std::vector<bool> has_child(root.size());
    for (std::uint32_t rank = 0; rank < root.size(); ++rank) {
      const auto [at, is_new] = first.try_emplace(key_of(box_of(cell_.positions_um[rank])), rank);
      if (!is_new) next[rank] = std::exchange(at->second, rank);
      if (cell_.parents[rank] != kNoParent) has_child[cell_.parents[rank]] = true;
    }
    std::vector<std::pair<double, Box>> around;  // boxes by their least distance
    for (std::int64_t x = -kReach; x <= kReach; ++x)
      for (std::int64_t y = -kReach; y <= kReach; ++y)
        for (std::int64_t z = -kReach; z <= kReach; ++z) {
          double squared = 0;
          for (const std::int64_t d : {x, y, z}) {
            const auto apart = static_cast<double>(std::max<std::int64_t>(0, std::abs(d) - 1));
            squared += apart * apart;
          }
          around.push_back({edge_um * std::sqrt(squared), {x, y, z}});
        }
    std::sort(around.begin(), around.end());
    for (std::uint32_t end = 0; end < root.size(); ++end) {
      if (cell_.parents[end] != kNoParent && has_child[end]) continue;
      const Box box = box_of(cell_.positions_um[end]);
      Candidate best{gap_um, end, kNoParent};
      for (const auto& [least_um, by] : around) {
        if (least_um > best.um) break;
        const auto list = first.find(key_of({box[0] + by[0], box[1] + by[1], box[2] + by[2]}));
        for (std::uint32_t at = list == first.end() ? kNoParent : list->second; at != kNoParent; at = next[at]) {
          if (root[at] == root[end] || (has_soma[root[at]] && has_soma[root[end]])) continue;
          const double um = (cell_.positions_um[at] - cell_.positions_um[end]).norm();
          if (um < best.um || (um == best.um && at < best.other)) best = {um, end, at};
        }
      }
      if (best.other != kNoParent) found.push_back(best);
    }
    std::sort(found.begin(), found.end(), [](const Candidate& a, const Candidate& b) {
      return std::tie(a.um, a.end, a.other) < std::tie(b.um, b.end, b.other);
    });
    return found;
  }

  void linkSomata() {
    const std::vector<std::uint32_t> root = rootsOf(cell_);
    const std::vector<bool> has_soma = treesWithSoma(cell_, root);
    std::vector<std::uint32_t> soma;
    for (std::uint32_t rank = 0; rank < cell_.samples() && soma.size() < kMostSoma; ++rank)
      if (cell_.types[rank] == kSomaType) soma.push_back(rank);
    for (std::uint32_t rank = 0; rank < cell_.samples(); ++rank) {
      if (root[rank] != rank || has_soma[rank]) continue;
      double nearest_um = std::min(RepairOptions::kSomaReach_um, most_um_);
      std::uint32_t parent = kNoParent;
      for (const std::uint32_t s : soma) {
        const auto radius_um = static_cast<double>(cell_.radii_um[s]);
        const double um =
            (cell_.positions_um[rank] - cell_.positions_um[s]).norm() - (std::isfinite(radius_um) ? radius_um : 0);
        if (um <= nearest_um && (parent == kNoParent || um < nearest_um)) nearest_um = um, parent = s;
      }
      if (parent == kNoParent) continue;
      cell_.parents[rank] = parent;
      note(ChangeKind::kSomaLinked, rank, cell_.sample_ids[parent],
           (cell_.positions_um[rank] - cell_.positions_um[parent]).norm());
    }
  }

  void setRadii() {
    const double um = options_.unknown_radius_um;
    std::vector<OddRadius> odd;
    for (std::uint32_t rank = 0; rank < cell_.samples(); ++rank) {
      if (!std::isnan(cell_.radii_um[rank])) continue;
      cell_.radii_um[rank] = storedRadius(um);
      if (isOddRadius(um)) odd.push_back({rank, um});
      note(ChangeKind::kRadiusSet, rank, 0, um);
    }
    const auto middle = static_cast<std::ptrdiff_t>(cell_.odd_radii.size());
    cell_.odd_radii.insert(cell_.odd_radii.end(), odd.begin(), odd.end());
    std::inplace_merge(cell_.odd_radii.begin(), cell_.odd_radii.begin() + middle, cell_.odd_radii.end(),
                       [](const OddRadius& a, const OddRadius& b) { return a.rank < b.rank; });
  }

  // The last line of a long header says how many lines are left out; in a file it would become one of them.
  void cutHeader() {
    const std::size_t last = cell_.header.rfind('\n');
    if (last == std::string::npos || !cell_.header.ends_with(Cell::kHeaderCut)) return;
    cell_.header.resize(last);
    note(ChangeKind::kHeaderCut, 0, 0, 0);
  }

  void renumber() {
    if (cell_.block_starts.empty()) return;
    const std::vector<std::int64_t> ids = distinctIds(cell_.sample_ids, cell_.block_starts);
    for (std::uint32_t rank = 0; rank < cell_.samples(); ++rank)
      if (ids[rank] != cell_.sample_ids[rank]) note(ChangeKind::kRenumbered, rank, ids[rank], 0);
    cell_.sample_ids = ids;
    cell_.block_starts.clear();
  }

  // Samples keep their order, but one whose parent comes later follows its parent, with all that waits for it.
  void orderParentsFirst() {
    const std::size_t n = cell_.samples();
    const auto is_late = [this](std::uint32_t rank) {
      return cell_.parents[rank] != kNoParent && cell_.parents[rank] > rank;
    };
    std::uint64_t late = 0;
    for (std::uint32_t rank = 0; rank < n; ++rank) late += is_late(rank);
    if (late == 0) return;
    std::vector<std::uint32_t> order, place(n, kNoParent), waiting(n, kNoParent), next(n, kNoParent), open;
    order.reserve(n);
    for (std::uint32_t rank = 0; rank < n; ++rank) {
      const std::uint32_t parent = cell_.parents[rank];
      if (parent != kNoParent && place[parent] == kNoParent) {
        next[rank] = std::exchange(waiting[parent], rank);
        continue;
      }
      for (open.push_back(rank); !open.empty();) {
        const std::uint32_t at = open.back();
        open.pop_back();
        place[at] = static_cast<std::uint32_t>(order.size());
        order.push_back(at);
        for (std::uint32_t child = waiting[at]; child != kNoParent; child = next[child]) open.push_back(child);
      }
    }
    note(ChangeKind::kParentsFirst, 0, 0, static_cast<double>(late));
    const auto permuted = [&order](auto& values) {
      auto moved = values;
      for (std::size_t i = 0; i < order.size(); ++i) moved[i] = values[order[i]];
      values = std::move(moved);
    };
    permuted(cell_.sample_ids);
    permuted(cell_.positions_um);
    permuted(cell_.radii_um);
    permuted(cell_.types);
    permuted(cell_.parents);
    for (std::uint32_t& parent : cell_.parents)
      if (parent != kNoParent) parent = place[parent];
    for (OddRadius& odd : cell_.odd_radii) odd.rank = place[odd.rank];
    std::sort(cell_.odd_radii.begin(), cell_.odd_radii.end(),
              [](const OddRadius& a, const OddRadius& b) { return a.rank < b.rank; });
    cell_.line_runs.clear();
  }

  Cell& cell_;
  const RepairOptions& options_;
  std::vector<RepairChange> changes_;
  double most_um_ = std::numeric_limits<double>::infinity();  // of a new link: a longer one would be dropped again
};

}  // namespace

std::string_view name(ChangeKind kind) {
  static constexpr std::string_view kNames[] = {"link_dropped",   "gap_joined", "soma_linked",   "turned_round",
                                                "unknown_radius", "renumbered", "parents_first", "header_cut"};
  return kNames[static_cast<std::size_t>(kind)];
}

std::vector<RepairChange> repair(Cell& cell, const RepairOptions& options) { return Repair(cell, options).run(); }

}  // namespace filiform
