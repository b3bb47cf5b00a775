#include "index/input/internal/neurite_sections.h"

#include "index/cell/soma.h"

#include <optional>

namespace filiform::internal {

void NeuriteSections::soma(std::span<const SectionPoint> contour) {
  soma_.insert(soma_.end(), contour.begin(), contour.end());
}

std::uint32_t NeuriteSections::section(std::uint32_t parent, std::uint16_t type, std::span<const SectionPoint> points) {
  sections_.push_back({parent, type, points_.size(), points_.size() + points.size()});
  points_.insert(points_.end(), points.begin(), points.end());
  return static_cast<std::uint32_t>(sections_.size() - 1);
}

void NeuriteSections::finish() {
  std::optional<std::int64_t> hub;
  if (!soma_.empty()) {
    Vector3d centre = Vector3d::Zero();
    for (const SectionPoint& point : soma_) centre += point.position;
    centre /= static_cast<double>(soma_.size());
    double radius = 0;
    for (const SectionPoint& point : soma_) radius += (point.position - centre).norm();
    radius = soma_.size() == 1 ? soma_[0].radius : radius / static_cast<double>(soma_.size());
    hub = static_cast<std::int64_t>(soma_[0].place);
    graph_.node(*hub, centre, radius, kSomaType, soma_[0].place, "");
    if (soma_.size() > 1) graph_.remark(InputCode::SOMA_CONTOUR, soma_[0].place, "");
    for (std::size_t i = 1; i < soma_.size(); ++i) graph_.mergePoint();
  }
  std::vector<std::size_t> last(sections_.size());  // of each section: the place in points_ of its end, or SIZE_MAX
  for (std::size_t s = 0; s < sections_.size(); ++s) {
    const Section& section = sections_[s];
    std::size_t before = section.parent == kNoSection ? SIZE_MAX : last[section.parent];
    for (std::size_t i = section.begin; i < section.end; ++i) {
      const SectionPoint& point = points_[i];
      if (i == section.begin && before != SIZE_MAX && points_[before].position == point.position) {
        graph_.mergePoint();
        graph_.remark(InputCode::REPEATED_POINT, point.place, "");
        continue;
      }
      const auto id = static_cast<std::int64_t>(point.place);
      graph_.node(id, point.position, point.radius, section.type, point.place, "");
      if (before != SIZE_MAX) {
        graph_.link(static_cast<std::int64_t>(points_[before].place), id, point.place);
      } else if (hub && soma_links_) {
        graph_.link(*hub, id, point.place);
        graph_.remark(InputCode::SOMA_LINK, point.place, "");
      }
      before = i;
    }
    last[s] = before;
  }
}

}  // namespace filiform::internal
