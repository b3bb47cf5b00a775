#include "index/compare/cell_change.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <optional>
#include <utility>
#include <vector>

#include <Eigen/Geometry>

namespace filiform {
namespace {

using Position = std::array<double, 3>;  // um; exact for points of every grid
struct SampleRow {
  Position place;
  std::uint64_t radius_bits;
  std::uint16_t type;
  auto operator<=>(const SampleRow&) const = default;
};
using SegmentRow = std::array<Position, 2>;  // the lower end first

double radius_um(const CellGraph& cell, std::uint32_t rank) {
  const double odd = cell.oddRadius_um(rank);
  return std::isnan(odd) ? static_cast<double>(cell.radii_um[rank]) : odd;
}

std::uint64_t radiusBits(const CellGraph& cell, std::uint32_t rank) {
  const double radius = radius_um(cell, rank);
  return std::bit_cast<std::uint64_t>(std::isnan(radius) ? static_cast<double>(kUnknownRadius) : radius);
}

Position positionOf(const CellGraph& cell, std::uint32_t rank) {
  const Vector3d p = cell.position_W(rank);
  return {p.x(), p.y(), p.z()};
}

std::vector<SampleRow> sampleRowsOf(const CellGraph& cell) {
  std::vector<SampleRow> rows;
  rows.reserve(cell.samples());
  for (std::uint32_t i = 0; i < cell.samples(); ++i)
    rows.push_back({positionOf(cell, i), radiusBits(cell, i), cell.types[i]});
  std::sort(rows.begin(), rows.end());
  return rows;
}

std::vector<SegmentRow> segmentRowsOf(const CellGraph& cell) {
  std::vector<SegmentRow> rows;
  for (const auto& [parent, child] : parentLinks(cell)) {
    SegmentRow row{positionOf(cell, parent), positionOf(cell, child)};
    if (row[1] < row[0]) std::swap(row[0], row[1]);
    rows.push_back(row);
  }
  std::sort(rows.begin(), rows.end());
  return rows;
}

// Keeps the rows that only one of the lists has.
template <class Row>
void keepDifferences(std::vector<Row>& a, std::vector<Row>& b) {
  std::vector<Row> only_a, only_b;
  std::set_difference(a.begin(), a.end(), b.begin(), b.end(), std::back_inserter(only_a));
  std::set_difference(b.begin(), b.end(), a.begin(), a.end(), std::back_inserter(only_b));
  a = std::move(only_a);
  b = std::move(only_b);
}

bool areEqualByRank(const CellGraph& a, const CellGraph& b) {
  if (a.grid.exponent() != b.grid.exponent() || a.positions != b.positions || a.parents != b.parents ||
      a.links != b.links || a.types != b.types)
    return false;
  for (std::uint32_t i = 0; i < a.samples(); ++i)
    if (radiusBits(a, i) != radiusBits(b, i)) return false;
  return true;
}

struct Motion {
  double moved_um, turned_rad, farthest_um;
};

// The rotation and translation that bring a to b, if they do so within `slack_um` of each sample. Source: Kabsch 1976.
std::optional<Motion> motionOf(const CellGraph& a, const CellGraph& b, double slack_um) {
  if (a.samples() != b.samples() || a.samples() == 0 || a.parents != b.parents || a.links != b.links ||
      a.types != b.types)
    return std::nullopt;
  Vector3d middle_a = Vector3d::Zero(), middle_b = Vector3d::Zero();
  double farthest_um = 0;
  for (std::uint32_t i = 0; i < a.samples(); ++i) {
    if (radiusBits(a, i) != radiusBits(b, i)) return std::nullopt;
    middle_a += a.position_W(i) / static_cast<double>(a.samples());
    middle_b += b.position_W(i) / static_cast<double>(a.samples());
    farthest_um = std::max(farthest_um, (b.position_W(i) - a.position_W(i)).norm());
  }
  const auto isBroughtTo = [&](const Eigen::Matrix3d& rotation) {
    for (std::uint32_t i = 0; i < a.samples(); ++i)
      if ((rotation * (a.position_W(i) - middle_a) - (b.position_W(i) - middle_b)).norm() > slack_um) return false;
    return true;
  };
  const double moved_um = (b.position_W(0) - a.position_W(0)).norm();
  // First without a rotation, so that a translation has none.
  if (isBroughtTo(Eigen::Matrix3d::Identity())) return Motion{moved_um, 0, farthest_um};
  Eigen::Matrix3Xd from(3, a.samples()), to(3, a.samples());
  for (std::uint32_t i = 0; i < a.samples(); ++i) {
    from.col(i) = a.position_W(i);
    to.col(i) = b.position_W(i);
  }
  const Eigen::Matrix3d rotation = Eigen::umeyama(from, to, false).topLeftCorner<3, 3>();
  if (!isBroughtTo(rotation)) return std::nullopt;
  return Motion{moved_um, std::abs(Eigen::AngleAxisd(rotation).angle()), farthest_um};
}

}  // namespace

std::string_view name(CellFate kind) {
  static constexpr std::array<std::string_view, 5> kNames{"same", "moved", "changed", "added", "removed"};
  return kNames.at(static_cast<std::size_t>(kind));
}

CellChange compareCells(const CellGraph& a, const CellGraph& b) {
  CellChange change;
  if (areEqualByRank(a, b)) return change;  // the usual case, without sorting
  std::vector<SampleRow> samples_a = sampleRowsOf(a), samples_b = sampleRowsOf(b);
  std::vector<SegmentRow> segments_a = segmentRowsOf(a), segments_b = segmentRowsOf(b);
  keepDifferences(samples_a, samples_b);
  keepDifferences(segments_a, segments_b);
  if (samples_a.empty() && samples_b.empty() && segments_a.empty() && segments_b.empty()) return change;

  // Each position is rounded by at most half a quantum an axis, and so is their mean.
  const double rounding_um = std::sqrt(3.0) * (a.grid.quantum_um() + b.grid.quantum_um()) / 2;
  const auto motion = motionOf(a, b, 2 * rounding_um);
  if (motion && motion->farthest_um <= rounding_um && a.grid.exponent() != b.grid.exponent()) return change;
  if (motion && motion->farthest_um > rounding_um) {
    change.kind = CellFate::kMoved;
    change.moved_um = motion->moved_um;
    change.turned_rad = motion->turned_rad;
    return change;
  }
  change.kind = CellFate::kChanged;
  change.segments_added = segments_b.size();
  change.segments_removed = segments_a.size();
  // What is left at one place on both sides is edited.
  std::size_t i = 0, k = 0;
  while (i < samples_a.size() && k < samples_b.size()) {
    const Position &place_a = samples_a[i].place, &place_b = samples_b[k].place;
    if (place_a < place_b) {
      ++i;
    } else if (place_b < place_a) {
      ++k;
    } else {
      ++change.samples_edited, ++i, ++k;
    }
  }
  change.samples_removed = samples_a.size() - change.samples_edited;
  change.samples_added = samples_b.size() - change.samples_edited;
  return change;
}

double lengthOf_um(const CellGraph& cell) {
  double length_um = 0;
  for (const auto& [parent, child] : parentLinks(cell))
    length_um += (cell.position_W(child) - cell.position_W(parent)).norm();
  return length_um;
}

}  // namespace filiform
