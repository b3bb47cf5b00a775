#include "viewer/window/travel/internal/path_measure.h"

#include "viewer/window/settings/internal/text_format.h"

namespace filiform::internal {

void PathMeasure::begin(const ProxyPlace& from) {
  end();
  from_ = from;
}

bool PathMeasure::isBehind(const ProxyPlace& to) const { return from_ && to.valid() && !(to_ && to_->p_W == to.p_W); }

void PathMeasure::measure(const ProxyPlace& to, const CellWalk& walk) {
  to_ = to;
  path_um_.reset();
  const std::string straight = format("%.2f \u00b5m straight", (to.p_W - from_->p_W).norm());
  text_.clear();
  if (from_->segment.cell != to.segment.cell) {
    text_ += straight;
    text_ += ", another cell";
    return;
  }
  const auto a = walk.spotOf(*from_), b = walk.spotOf(to);
  if (a && b) path_um_ = walk.paths().length_um(*a, *b);
  if (path_um_) text_ += format("%.2f \u00b5m along the path, ", *path_um_);
  text_ += straight;
  if (!path_um_) text_ += ", no path";
}

std::string PathMeasure::text() const {
  if (!isOn()) return {};
  return text_.empty() ? "from here" : text_;
}

}  // namespace filiform::internal
