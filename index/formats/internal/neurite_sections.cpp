#include "index/formats/internal/neurite_sections.h"

#include "index/formats/internal/soma_link.h"

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
  SomaLinks somata(graph_, soma_links_);
  if (!soma_.empty()) {
    std::vector<Vector3d> contour;
    for (const SectionPoint& point : soma_) contour.push_back(point.position);
    const std::uint64_t place = soma_[0].place;
    somata.soma(static_cast<std::int64_t>(place), sphereOfContour(contour), soma_[0].radius, place);
    if (soma_.size() > 1) graph_.remark(InputCode::SOMA_CONTOUR, place, "");
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
      if (graph_.node(id, point.position, point.radius, section.type, point.place, "point")) {
        if (before != SIZE_MAX)
          graph_.link(static_cast<std::int64_t>(points_[before].place), id, point.place);
        else
          somata.link(id, point.position, point.place);
      }
      before = i;
    }
    last[s] = before;
  }
}

}  // namespace filiform::internal
