#include "index/measure/cell_tree.h"

#include "index/cell/internal/spanning_forest.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <span>

namespace filiform {
namespace {

constexpr std::uint32_t kNoRank = CellTree::kNone;

struct TreeInput {
  std::span<const std::uint32_t> parents;
  std::span<const std::uint16_t> types;
  std::span<const std::array<std::uint32_t, 2>> links;  // {child, parent} of a cell with loops
};

template <typename Place, typename Radius>
class TreeMaker {
 public:
  TreeMaker(const TreeInput& input, const CellSomata& somata, const Place& place, const Radius& radius)
      : input_(input), place_(place), radius_(radius) {
    listChildren();
    makeSoma(somata);
    tree_.points_um.reserve(input_.parents.size());
    tree_.radii_um.reserve(input_.parents.size());
    if (!input_.links.empty()) point_of_.assign(input_.parents.size(), kNoRank), neurite_of_ = point_of_;
    for (std::uint32_t rank = 0; rank < input_.parents.size(); ++rank)
      if (beginsNeurite(rank)) makeNeurite(rank);
    makeClosings();
  }
  CellTree take() { return std::move(tree_); }

 private:
  bool isSoma(std::uint32_t rank) const { return input_.types[rank] == kSomaType; }
  bool beginsNeurite(std::uint32_t rank) const {
    if (isSoma(rank)) return false;
    const std::uint32_t parent = input_.parents[rank];
    return parent == kNoParent ? first_child_[rank] != kNoRank : isSoma(parent);
  }

  // Of samples that are no soma, by rank: lists from which each child leads to its next sibling.
  void listChildren() {
    const std::size_t samples = input_.parents.size();
    first_child_.assign(samples, kNoRank);
    next_sibling_.assign(samples, kNoRank);
    for (std::size_t i = samples; i-- > 0;) {
      const std::uint32_t parent = input_.parents[i];
      if (parent == kNoParent || isSoma(static_cast<std::uint32_t>(i)) || isSoma(parent)) continue;
      next_sibling_[i] = first_child_[parent];
      first_child_[parent] = static_cast<std::uint32_t>(i);
    }
  }

  // A root and its two children: the first samples of the file, or in the right places.
  bool isThreePoint(const std::vector<std::uint32_t>& ranks, const CellSomata& somata) const {
    if (ranks.size() != 3 || input_.parents[ranks[0]] != kNoParent || input_.parents[ranks[1]] != ranks[0] ||
        input_.parents[ranks[2]] != ranks[0])
      return false;
    return ranks[2] == 2 || (somata.somata.size() == 1 && somata.somata[0].form == Soma::Form::kThreePoint);
  }

  void makeSoma(const CellSomata& somata) {
    std::vector<std::uint32_t> ranks;
    for (std::uint32_t rank = 0; rank < input_.types.size(); ++rank)
      if (isSoma(rank)) ranks.push_back(rank);
    SomaShape& soma = tree_.soma;
    soma.samples = static_cast<std::uint32_t>(ranks.size());
    if (ranks.empty()) return;
    soma.centre_um = place_(ranks[0]);
    const auto known = [&](std::uint32_t rank) {
      const double radius_um = radius_(rank);
      return std::isnan(radius_um) ? 0.0 : radius_um;
    };
    using std::numbers::pi;
    const auto ball = [&soma](double radius_um) {
      soma.radius_um = radius_um;
      soma.area_um2 = 4 * pi * radius_um * radius_um;
      soma.volume_um3 = 4 * pi / 3 * radius_um * radius_um * radius_um;
    };
    if (ranks.size() == 1) {
      soma.form = SomaShape::Form::kOne;
      ball(known(ranks[0]));
    } else if (isThreePoint(ranks, somata)) {
      soma.form = SomaShape::Form::kThreePoint;
      const double r = known(ranks[0]), height_um = (place_(ranks[1]) - place_(ranks[2])).norm();
      soma.area_um2 = 2 * pi * r * height_um;
      soma.radius_um = std::sqrt(soma.area_um2 / (4 * pi));
      soma.volume_um3 = 2 * pi * soma.radius_um * soma.radius_um * soma.radius_um;
    } else if (somata.somata.size() == 1 && somata.somata[0].form == Soma::Form::kContour &&
               somata.somata[0].samples.size() + 1 == ranks.size()) {
      soma.form = SomaShape::Form::kContour;
      soma.centre_um = somata.somata[0].centre_um;
      ball(somata.somata[0].radius_um);
    } else {
      soma.form = SomaShape::Form::kCylinders;
      for (std::size_t i = 1; i < ranks.size(); ++i) {
        const double a = known(ranks[i - 1]), b = known(ranks[i]);
        const double h2 = (place_(ranks[i]) - place_(ranks[i - 1])).squaredNorm();
        soma.area_um2 += pi * (a + b) * std::sqrt((a - b) * (a - b) + h2);
        soma.volume_um3 += pi / 3 * std::sqrt(h2) * (a * a + a * b + b * b);
      }
      soma.radius_um = std::sqrt(soma.area_um2 / (4 * pi));
    }
  }

  void addPoint(std::uint32_t rank) {
    tree_.points_um.push_back(place_(rank));
    tree_.radii_um.push_back(radius_(rank));
  }

  void makeNeurite(std::uint32_t root) {
    const auto id = static_cast<std::uint32_t>(tree_.neurites.size());
    CellTree::Neurite neurite;
    neurite.first = static_cast<std::uint32_t>(tree_.sections.size());
    neurite.rank = root;
    neurite.type = input_.types[root];
    if (const std::uint32_t soma = input_.parents[root]; soma != kNoParent)
      neurite.soma_link_um = (place_(root) - place_(soma)).norm();
    todo_.assign(1, {root, kNoRank});
    while (!todo_.empty()) {
      const auto [start, parent] = todo_.back();
      todo_.pop_back();
      CellTree::Section section;
      section.first = static_cast<std::uint32_t>(tree_.points_um.size());
      section.parent = parent;
      if (parent != kNoRank) {
        const std::uint32_t fork = tree_.sections[parent].rank;
        section.begins_at_fork = place_(fork) != place_(start);
        if (section.begins_at_fork) addPoint(fork);
      }
      std::uint32_t at = start;
      for (;; at = first_child_[at]) {
        if (!point_of_.empty()) {
          point_of_[at] = static_cast<std::uint32_t>(tree_.points_um.size());
          neurite_of_[at] = id;
        }
        addPoint(at);
        if (first_child_[at] == kNoRank || next_sibling_[first_child_[at]] != kNoRank) break;
      }
      section.count = static_cast<std::uint32_t>(tree_.points_um.size()) - section.first;
      section.rank = at;
      const auto own = static_cast<std::uint32_t>(tree_.sections.size());
      const std::size_t first = todo_.size();
      for (std::uint32_t child = first_child_[at]; child != kNoRank; child = next_sibling_[child]) {
        todo_.push_back({child, own});
        ++section.children;
      }
      std::reverse(todo_.begin() + static_cast<std::ptrdiff_t>(first), todo_.end());
      tree_.sections.push_back(section);
    }
    neurite.count = static_cast<std::uint32_t>(tree_.sections.size()) - neurite.first;
    tree_.neurites.push_back(neurite);
  }

  void makeClosings() {
    if (input_.links.empty()) return;
    std::vector<bool> used(input_.parents.size());
    for (const auto& [child, parent] : input_.links) {
      if (child == parent) continue;
      if (input_.parents[child] == parent && !used[child]) {
        used[child] = true;
      } else if (neurite_of_[child] != kNoRank && neurite_of_[parent] != kNoRank) {
        tree_.closings.push_back({neurite_of_[child], {point_of_[child], point_of_[parent]}});
      }
    }
  }

  struct Start {
    std::uint32_t rank, parent;  // parent: a section
  };
  TreeInput input_;
  const Place& place_;
  const Radius& radius_;
  CellTree tree_;
  std::vector<std::uint32_t> first_child_, next_sibling_;
  std::vector<std::uint32_t> point_of_, neurite_of_;  // by rank; only for a cell with loops
  std::vector<Start> todo_;
};

template <typename Place, typename Radius>
CellTree madeTree(const TreeInput& input, const CellSomata& somata, const Place& place, const Radius& radius) {
  return TreeMaker<Place, Radius>(input, somata, place, radius).take();
}

}  // namespace

CellTree treeOf(const CellGraph& cell) {
  return madeTree(
      {cell.parents, cell.types, cell.links}, cell.somata, [&](std::uint32_t rank) { return cell.position_W(rank); },
      [&](std::uint32_t rank) {
        const double odd_um = cell.oddRadius_um(rank);
        return std::isnan(odd_um) ? static_cast<double>(cell.radii_um[rank]) : odd_um;
      });
}

CellTree treeOf(const Cell& cell) {
  const std::vector<std::uint32_t> forest =
      cell.isGraph() ? spanningForest(cell.samples(), cell.links).parents : std::vector<std::uint32_t>{};
  return madeTree(
      {cell.isGraph() ? forest : cell.parents, cell.types, cell.links}, somataOf(cell),
      [&](std::uint32_t rank) { return cell.positions_um[rank]; },
      [&](std::uint32_t rank) { return static_cast<double>(cell.radii_um[rank]); });
}

}  // namespace filiform
