#include "index/query/cell_sections.h"

#include "index/cell/soma.h"
#include "index/errors.h"
#include "index/text.h"

#include <algorithm>
#include <cmath>
#include <numeric>

namespace filiform {

CellSections::CellSections(const CellPaths& cell) : cell_(cell) {
  if (cell.graph().isGraph())
    throw UsageError("'" + escaped(cell.graph().name, 80) + "' has loops, so it has no sections; give a sample");
  order();
  cut();
  for (std::uint32_t s = 0; s < sections_.size(); ++s) hang(s);
  measure();
}

// By id, as Import3d reads a file; in the order of the file if ids repeat.
void CellSections::order() {
  const std::vector<std::int64_t>& ids = cell_.graph().sample_ids;
  order_.resize(ids.size());
  std::iota(order_.begin(), order_.end(), 0u);
  if (cell_.graph().block_starts.empty())
    std::stable_sort(order_.begin(), order_.end(), [&](std::uint32_t a, std::uint32_t b) { return ids[a] < ids[b]; });
  index_.resize(ids.size());
  for (std::uint32_t i = 0; i < order_.size(); ++i) index_[order_[i]] = i;
}

std::uint32_t CellSections::parentOf(std::uint32_t index) const {
  const std::uint32_t parent = cell_.graph().parents[order_[index]];
  return parent == kNoParent ? kNoParent : index_[parent];
}

double CellSections::distance_um(std::uint32_t a, std::uint32_t b) const {
  return (cell_.graph().position_W(order_[a]) - cell_.graph().position_W(order_[b])).norm();
}

// A section ends at a sample unless its only child is the next sample, of the same type.
void CellSections::cut() {
  const auto n = static_cast<std::uint32_t>(order_.size());
  const auto isSoma = [&](std::uint32_t i) { return typeOf(i) == kSomaType; };
  std::vector<std::uint32_t> children(n, 0);
  std::vector<bool> breaks(n, false);
  soma_below_.assign(n, 0);
  at_beginning_.assign(n, false);
  for (std::uint32_t i = 0; i < n; ++i) {
    const std::uint32_t p = parentOf(i);
    if (p == kNoParent) continue;
    ++children[p];
    if (isSoma(i) && isSoma(p)) ++soma_below_[p];
    if (p + 1 != i) {
      breaks[p] = true;
      const std::uint32_t above = parentOf(p);
      const bool is_held = p > 1 && !isSoma(p) && above != kNoParent && isSoma(above);
      if (is_held || (p == 0 && !isSoma(0))) {
        at_beginning_[i] = true;
        children[p] = 1;
        breaks[p] = false;
      }
    }
    if (typeOf(p) != typeOf(i)) breaks[p] = true;
  }
  const auto somata = std::count_if(order_.begin(), order_.end(),
                                    [&](std::uint32_t rank) { return cell_.graph().types[rank] == kSomaType; });
  if (somata == 3 && n >= 3 && parentOf(1) == 0 && parentOf(2) == 0 && children[1] == 0 && children[2] == 0) {
    const std::vector<float>& radii = cell_.graph().radii_um;
    const float radius_um = radii[order_[0]];
    is_sphere_ = radii[order_[1]] == radius_um && radii[order_[2]] == radius_um &&
                 std::abs((distance_um(0, 1) + distance_um(0, 2)) / (2 * radius_um) - 1) < 0.01;
  }
  sections_.clear();
  section_of_.resize(n);
  for (std::uint32_t i = 0, begin = 0; i < n; ++i) {
    section_of_[i] = static_cast<std::uint32_t>(sections_.size());
    bool ends = children[i] != 1 || breaks[i];
    if (i + 1 < n && isSoma(i) && isSoma(i + 1) && (parentOf(i + 1) == i || (is_sphere_ && i < 2)))
      ends = i != 0 && soma_below_[i] > 1;
    if (!ends && i + 1 < n && (parentOf(i + 1) == i || (is_sphere_ && i < 2))) continue;
    Section section;
    section.begin = begin;
    section.end = begin = i + 1;
    section.parent = parentOf(section.begin);
    sections_.push_back(section);
  }
}

// Where the section hangs on its parent's, and whether by a wire.
void CellSections::hang(std::uint32_t number) {
  Section& section = sections_[number];
  const std::uint32_t first = section.begin, own = section.end - section.begin, p = section.parent;
  if (p == kNoParent) {
    section.is_ball = own == 1 || (number == 0 && is_sphere_);
    return;
  }
  const std::uint32_t parent_number = section_of_[p];
  const Section& parent = sections_[parent_number];
  const bool on_soma = typeOf(parent.begin) == kSomaType, is_soma = typeOf(first) == kSomaType;
  const bool is_root = parent_number == 0;
  const std::uint32_t points = is_root && is_sphere_ ? 1 : parent.end - parent.begin + (is_root ? 0 : 1);
  const bool may_be_wired = !is_soma && own > 1;
  if (is_root && on_soma && !is_soma && points == 1) {
    section.parent_pos = 0.5;
    section.is_wired = may_be_wired;
  } else if (is_root && p == parent.begin) {
    section.parent_pos = 0;
    section.is_wired = !is_soma && soma_below_[p] > 1;
  } else if (on_soma) {
    if (p + (parent.begin == 0 ? 1 : 2) < parent.begin + points) {  // inside a soma
      section.parent_pos = 0.5;
      section.is_wired = may_be_wired;
    } else {
      section.is_wired = may_be_wired && soma_below_[p] > 1;
    }
  }
  if (at_beginning_[first]) section.parent_pos = 0;
}

void CellSections::measure() {
  along_um_.assign(order_.size(), 0);
  for (Section& section : sections_) {
    const bool from_parent = section.parent != kNoParent && !section.is_wired;
    double along = from_parent ? distance_um(section.begin, section.parent) : 0;
    for (std::uint32_t i = section.begin; i < section.end; ++i) {
      if (i > section.begin) along += distance_um(i, i - 1);
      along_um_[i] = along;
    }
    section.length_um = along;
    const std::uint32_t points = section.end - section.begin + (from_parent ? 1 : 0);
    section.is_left_out = section.parent != kNoParent && (points < 2 || (points == 2 && along == 0));
  }
  for (std::uint32_t s = 0; s < sections_.size(); ++s)
    if (!sections_[s].is_left_out) by_number_.push_back(s);
  std::stable_sort(by_number_.begin(), by_number_.end(), [this](std::uint32_t a, std::uint32_t b) {
    return typeOf(sections_[a].begin) < typeOf(sections_[b].begin);
  });
  for (std::uint32_t number = 0; number < by_number_.size(); ++number) sections_[by_number_[number]].number = number;
}

// A place of a section; of one that is left out, the place where it hangs.
SectionPlace CellSections::endOf(const Section& section, double pos) const {
  const Section* at = &section;
  for (std::size_t steps = 0; at->is_left_out && at->parent != kNoParent && steps < sections_.size(); ++steps) {
    pos = at->parent_pos;
    at = &sections_[section_of_[at->parent]];
  }
  return {at->number, at->is_ball ? 0.5 : pos};
}

SectionPlace CellSections::of(const CellPlace& place) const {
  const std::uint32_t i = index_[place.t == 1 ? place.parent : place.child];
  const Section& section = sections_[section_of_[i]];
  if (section.is_ball || section.is_left_out || section.length_um == 0) return endOf(section, 0);
  double along = along_um_[i];
  if (place.t > 0 && place.t < 1) along -= place.t * distance_um(i, index_[place.parent]);
  return endOf(section, std::clamp(along / section.length_um, 0.0, 1.0));
}

std::optional<CellPlace> CellSections::at(std::uint32_t number, double pos) const {
  if (number >= size()) return std::nullopt;
  const Section& section = sections_[by_number_[number]];
  if (section.is_ball || section.length_um == 0) return cell_.at(order_[section.begin]);
  const double target = pos * section.length_um;
  std::uint32_t i = section.begin;
  while (i + 1 < section.end && along_um_[i] < target) ++i;
  const std::uint32_t before = i > section.begin ? i - 1 : section.parent;
  const double step = before == kNoParent || along_um_[i] <= target ? 0 : distance_um(i, before);
  if (step <= 0) return cell_.at(order_[i]);
  const double t = std::clamp((along_um_[i] - target) / step, 0.0, 1.0);
  if (t == 1) return cell_.at(order_[before]);
  return cell_.on(order_[i], t);
}

}  // namespace filiform
