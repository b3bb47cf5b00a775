#include "index/measure/cell_measures.h"

#include "index/errors.h"
#include "index/measure/internal/angle.h"
#include "index/measure/internal/principal_axes.h"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <map>
#include <numbers>

namespace filiform {
namespace {

// Spheres about the soma's centre with the radii first + i step.
class Spheres {
 public:
  Spheres(const SomaShape& soma, double step_um)
      : centre_(soma.centre_um), first_(soma.radius_um), step_(step_um), on_(step_um > 0 && soma.samples > 0) {}
  bool on() const { return on_; }

  // Makes room for points up to this distance.
  void reach(double most_um, Measures& m) const {
    const double count = std::ceil(most_um / step_);
    if (!(count <= kMostSpheres))
      throw UsageError("Sholl analysis with a step of " + std::to_string(step_) +
                       " um needs more than 1000000 spheres;" + " give a larger step");
    m.sholl.resize(static_cast<std::size_t>(count));
    m.sholl_by_ends = m.sholl;
  }

  void count(const Vector3d& a, const Vector3d& b, Measures& m) const {
    const Vector3d u = a - centre_, v = b - centre_, w = v - u;
    const double d1 = u.squaredNorm(), d2 = v.squaredNorm(), near = std::min(d1, d2), far = std::max(d1, d2);
    const std::size_t bins = m.sholl.size();
    // Spheres with near < r <= far: the segment passes each once. By ends, also those with r = near.
    const std::size_t in = notBeyond(near, bins), out = notBeyond(far, bins);
    for (std::size_t i = in; i < out; ++i) ++m.sholl[i], ++m.sholl_by_ends[i];
    for (std::size_t i = in; i-- > 0 && radius2(i) == near;) ++m.sholl_by_ends[i];
    // It may pass nearer to the centre than both ends.
    const double along = -u.dot(w), whole = w.squaredNorm();
    if (in == 0 || !(along > 0) || !(along < whole)) return;
    const double nearest = d1 - along * (along / whole);
    for (std::size_t i = in; i-- > 0 && radius2(i) > nearest;) m.sholl[i] += 2;
  }

 private:
  double radius2(std::size_t i) const {
    const double r = first_ + static_cast<double>(i) * step_;
    return r * r;
  }
  // The number of spheres, among the first `bins`, whose squared radius is at most d2.
  std::size_t notBeyond(double d2, std::size_t bins) const {
    const double guess = (std::sqrt(d2) - first_) / step_ + 1;
    std::size_t n = guess > 0 ? std::min(bins, static_cast<std::size_t>(guess)) : 0;
    while (n < bins && radius2(n) <= d2) ++n;
    while (n > 0 && radius2(n - 1) > d2) --n;
    return n;
  }

  Vector3d centre_;
  double first_, step_;
  bool on_;
};

class NeuriteMeasurer {
 public:
  NeuriteMeasurer(const CellTree& tree, const MeasureOptions& options)
      : tree_(tree), options_(options), spheres_(tree.soma, options.sholl_um) {}

  Measures measure(std::uint32_t id, CellMeasures& cell) {
    const CellTree::Neurite& neurite = tree_.neurites[id];
    sections_ = tree_.sections.data() + neurite.first;
    count_ = neurite.count;
    first_ = neurite.first;
    arrange();
    Measures m;
    m.neurites = 1;
    m.soma_link_um = neurite.soma_link_um;
    const Vector3d from = tree_.soma.samples > 0 ? tree_.soma.centre_um : point(sections_[0].first);
    if (spheres_.on()) spheres_.reach(farthest_um(from), m);
    for (std::uint32_t s = 0; s < count_; ++s) {
      Measures own;
      measureSection(s, from, own, m);
      m.add(own);
      if (options_.per == MeasurePer::kBranch) {
        const std::uint32_t parent = sections_[s].parent;
        cell.parts.push_back({neurite.type, id, s, parent == CellTree::kNone ? parent : parent - first_,
                              sections_[s].rank, 0, std::move(own)});
      }
    }
    measureExtents(m);
    return m;
  }

  void measureClosing(const CellTree::Closing& closing, Measures& m) const {
    ++m.loops;
    measureSegment(closing.points[0], closing.points[1], m, m);
  }

 private:
  const Vector3d& point(std::uint32_t i) const { return tree_.points_um[i]; }
  double knownRadius(std::uint32_t i) const { return std::isnan(tree_.radii_um[i]) ? 0 : tree_.radii_um[i]; }
  std::uint32_t last(const CellTree::Section& section) const { return section.first + section.count - 1; }
  // The second point, or the only one.
  std::uint32_t second(const CellTree::Section& section) const { return section.first + (section.count > 1 ? 1 : 0); }
  std::uint32_t parentOf(std::uint32_t s) const { return sections_[s].parent - first_; }

  // What follows from the tree alone: sections below, Strahler orders, branch orders.
  void arrange() {
    below_.assign(count_, 1);
    strahler_.assign(count_, 1);
    holders_.assign(count_, 0);
    order_.assign(count_, 0);
    path_um_.assign(count_, 0);
    for (std::uint32_t s = count_; s-- > 0;) {  // children come after their parents
      if (holders_[s] > 1) ++strahler_[s];
      if (sections_[s].parent == CellTree::kNone) continue;
      const std::uint32_t parent = parentOf(s);
      below_[parent] += below_[s];
      if (holders_[parent] == 0 || strahler_[s] > strahler_[parent]) {
        strahler_[parent] = strahler_[s];
        holders_[parent] = 1;
      } else if (strahler_[s] == strahler_[parent]) {
        ++holders_[parent];
      }
    }
  }

  double farthest_um(const Vector3d& from) const {
    double most = 0;
    const CellTree::Section& end = sections_[count_ - 1];
    for (std::uint32_t i = sections_[0].first; i < end.first + end.count; ++i)
      most = std::max(most, (point(i) - from).squaredNorm());
    return std::sqrt(most);
  }

  // `sholl` has the bins; of a section, those of its neurite.
  void measureSegment(std::uint32_t p, std::uint32_t q, Measures& m, Measures& sholl) const {
    const double h = (point(q) - point(p)).norm(), a = knownRadius(p), b = knownRadius(q);
    ++m.segments;
    m.zero_segments += h == 0;
    m.length_um += h;
    m.area_um2 += std::numbers::pi * (a + b) * std::sqrt((a - b) * (a - b) + h * h);
    m.volume_um3 += std::numbers::pi / 3 * h * (a * a + a * b + b * b);
    if (spheres_.on()) spheres_.count(point(p), point(q), sholl);
  }

  void measureSection(std::uint32_t s, const Vector3d& from, Measures& m, Measures& sholl) {
    const CellTree::Section& section = sections_[s];
    const std::uint32_t end = last(section);
    for (std::uint32_t i = section.first; i <= end; ++i) {
      m.lo_um = m.lo_um.cwiseMin(point(i));
      m.hi_um = m.hi_um.cwiseMax(point(i));
      if (i > section.first) measureSegment(i - 1, i, m, sholl);
      m.unknown_radii += std::isnan(tree_.radii_um[i]) && !(section.begins_at_fork && i == section.first);
    }
    m.sections = 1;
    m.section_length_um.add(m.length_um);
    const bool is_root = section.parent == CellTree::kNone;
    path_um_[s] = m.length_um + (is_root ? 0 : path_um_[parentOf(s)]);
    order_[s] = is_root ? 0 : order_[parentOf(s)] + 1;
    const double radial_um = (point(end) - from).norm();
    m.section_radial_um.add(radial_um);
    m.branch_order.add(order_[s]);
    m.strahler_order.add(strahler_[s]);
    const double straight_um = (point(end) - point(section.first)).norm();
    if (straight_um > 0) {
      m.tortuosity.add(m.length_um / straight_um);
    } else if (section.count == 1) {
      m.tortuosity.add(1);
    }
    if (m.length_um > 0) m.taper.add(2 * (knownRadius(section.first) - knownRadius(end)) / m.length_um);
    m.forks = section.children > 1;
    if (section.children == 0) {
      m.tips = 1;
      m.tip_path_um.add(path_um_[s]);
      m.tip_radial_um.add(radial_um);
    } else if (section.children == 2) {
      m.bifurcations = 1;
      measureBifurcation(s, m);
    }
  }

  // To the first point of the section that differs from `fork`.
  Vector3d firstStep(const CellTree::Section& section, const Vector3d& fork) const {
    for (std::uint32_t i = section.first; i < section.first + section.count; ++i)
      if (point(i) != fork) return point(i) - fork;
    return Vector3d::Zero();
  }

  void measureBifurcation(std::uint32_t s, Measures& m) const {
    const CellTree::Section &a = sections_[s + 1], &b = sections_[s + 1 + below_[s + 1]];
    const double n = below_[s + 1], k = below_[s + 1 + below_[s + 1]];
    m.asymmetry.add(std::abs(n - k) / (n + k));
    m.asymmetry_uylings.add(n + k > 2 ? std::abs(n - k) / (n + k - 2) : 0);
    const std::uint32_t end = last(sections_[s]);
    const Vector3d& fork = point(end);
    m.remote_angle_rad.add(internal::angleBetween_rad(point(last(a)) - fork, point(last(b)) - fork));
    m.local_angle_rad.add(internal::angleBetween_rad(firstStep(a, fork), firstStep(b, fork)));
    const double r = knownRadius(end), ra = knownRadius(second(a)), rb = knownRadius(second(b));
    if (std::max(ra, rb) > 0) m.sibling_ratio.add(std::min(ra, rb) / std::max(ra, rb));
    const auto power = [r](double child) { return r / child * std::sqrt(r / child); };
    if (std::min(ra, rb) > 0) m.diameter_power.add(power(ra) + power(rb));
  }

  // Each place along the neurite counts once: samples at the place of the sample before do not.
  template <typename Visit>
  void visitPlaces(const Visit& visit) const {
    for (std::uint32_t s = 0; s < count_; ++s) {
      const CellTree::Section& section = sections_[s];
      // Without a copy of the fork, the first sample of a child section lies at the fork.
      std::uint32_t i = section.first + (section.parent != CellTree::kNone ? 1 : 0);
      for (; i < section.first + section.count; ++i)
        if (i == section.first || point(i) != point(i - 1)) visit(point(i));
    }
  }

  void measureExtents(Measures& m) const {
    // Sums about the first point, so that few digits cancel.
    const Vector3d origin = point(sections_[0].first);
    Vector3d sum = Vector3d::Zero();
    Eigen::Matrix3d squares = Eigen::Matrix3d::Zero();
    double places = 0;
    visitPlaces([&](const Vector3d& p) {
      const Vector3d d = p - origin;
      sum += d;
      squares += d * d.transpose();
      ++places;
    });
    const Eigen::Matrix3d axes = internal::eigenvectors(squares - sum * (sum.transpose() / places));
    Vector3d lo = Vector3d::Constant(std::numeric_limits<double>::infinity()), hi = -lo;
    visitPlaces([&](const Vector3d& p) {
      const Vector3d along = axes.transpose() * (p - origin);
      lo = lo.cwiseMin(along);
      hi = hi.cwiseMax(along);
    });
    Vector3d extents = hi - lo;
    std::sort(extents.data(), extents.data() + 3, std::greater<>());
    for (int axis = 0; axis < 3; ++axis) m.extents_um[static_cast<std::size_t>(axis)].add(extents[axis]);
  }

  const CellTree& tree_;
  const MeasureOptions& options_;
  Spheres spheres_;
  const CellTree::Section* sections_ = nullptr;  // of the neurite
  std::uint32_t count_ = 0, first_ = 0;
  std::vector<std::uint32_t> below_, strahler_, holders_, order_;  // by section of the neurite
  std::vector<double> path_um_;                                    // from the first sample to the section's end
};

constexpr std::string_view kNeuriteTypes[] = {"undefined", "soma", "axon", "basal", "apical"};  // by code

}  // namespace

std::span<const std::string_view> neuriteTypeNames() { return kNeuriteTypes; }

std::optional<std::uint16_t> neuriteType(std::string_view word) {
  const auto* const found = std::find(std::begin(kNeuriteTypes), std::end(kNeuriteTypes), word);
  if (found != std::end(kNeuriteTypes)) return static_cast<std::uint16_t>(found - std::begin(kNeuriteTypes));
  std::uint16_t code = 0;
  const auto [end, error] = std::from_chars(word.data(), word.data() + word.size(), code);
  if (word.empty() || error != std::errc() || end != word.data() + word.size()) return std::nullopt;
  return code;
}

std::string neuriteTypeName(std::uint16_t type) {
  return type < std::size(kNeuriteTypes) ? std::string(kNeuriteTypes[type]) : std::to_string(type);
}

CellMeasures measuresOf(const CellTree& tree, const MeasureOptions& options) {
  CellMeasures cell;
  cell.soma = tree.soma;
  NeuriteMeasurer measurer(tree, options);
  std::map<std::uint16_t, Measures> types;
  std::size_t closing = 0;
  std::vector<CellTree::Closing> closings = tree.closings;
  std::stable_sort(closings.begin(), closings.end(),
                   [](const auto& a, const auto& b) { return a.neurite < b.neurite; });
  for (std::uint32_t id = 0; id < tree.neurites.size(); ++id) {
    const CellTree::Neurite& neurite = tree.neurites[id];
    if (!options.types.empty() &&
        std::find(options.types.begin(), options.types.end(), neurite.type) == options.types.end())
      continue;
    Measures m = measurer.measure(id, cell);
    while (closing < closings.size() && closings[closing].neurite < id) ++closing;
    for (; closing < closings.size() && closings[closing].neurite == id; ++closing)
      measurer.measureClosing(closings[closing], m);
    cell.all.add(m);
    if (options.per == MeasurePer::kType) types[neurite.type].add(m);
    if (options.per == MeasurePer::kNeurite)
      cell.parts.push_back({neurite.type, id, CellTree::kNone, CellTree::kNone, neurite.rank, 0, std::move(m)});
  }
  cell.all.cells = 1;
  for (auto& [type, m] : types) {
    m.cells = 1;
    cell.parts.push_back({type, CellTree::kNone, CellTree::kNone, CellTree::kNone, CellTree::kNone, 0, std::move(m)});
  }
  return cell;
}

}  // namespace filiform
