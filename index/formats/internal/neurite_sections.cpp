#include "index/formats/internal/neurite_sections.h"

#include "index/formats/internal/soma_link.h"
#include "index/formats/internal/tree_joins.h"

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
  TreeJoins joins;
  std::vector<std::uint32_t> tree(sections_.size());
  std::uint32_t trees = 0;
  for (std::size_t s = 0; s < sections_.size(); ++s) {
    const Section& section = sections_[s];
    const bool begins = section.parent == kNoSection;
    tree[s] = begins ? trees++ : tree[section.parent];
    if (begins) joins.begins(section.begin, points_[section.begin].position);
  }
  const auto repeatsParent = [&](const Section& section, std::size_t i, std::size_t before) {
    return i == section.begin && before != SIZE_MAX && points_[before].position == points_[i].position;
  };
  for (std::size_t s = 0; s < sections_.size(); ++s) {
    const Section& section = sections_[s];
    const bool begins = section.parent == kNoSection;
    for (std::size_t i = section.begin + begins; i < section.end; ++i)
      if (begins || !repeatsParent(section, i, sections_[section.parent].end - 1))
        joins.inside(i, points_[i].position, tree[s]);
  }
  std::vector<std::size_t> last(sections_.size());  // of each section: the place in points_ of its end, or SIZE_MAX
  for (std::size_t s = 0; s < sections_.size(); ++s) {
    const Section& section = sections_[s];
    std::size_t before = section.parent == kNoSection ? SIZE_MAX : last[section.parent];
    for (std::size_t i = section.begin; i < section.end; ++i) {
      const SectionPoint& point = points_[i];
      const std::size_t joined = joins.at(i);
      if (joined != i || repeatsParent(section, i, before)) {
        graph_.mergePoint();
        graph_.remark(InputCode::REPEATED_POINT, point.place, "");
        if (joined != i) before = joined;
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
