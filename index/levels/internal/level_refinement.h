// LevelRefinement: the parts of a choice of levels. It replaces parts by finer ones while the segments stay within a
// limit (Levels::choose()). Thread rule: thread-compatible.
#pragma once

#include "index/levels/level_parts.h"

#include <cmath>
#include <functional>
#include <queue>
#include <utility>
#include <vector>

namespace filiform::internal {

class LevelRefinement {
 public:
  using Finer = std::function<std::vector<LevelPart>(const LevelPart&)>;
  LevelRefinement(std::vector<LevelPart> parts, std::uint64_t segments, std::uint64_t most, Finer finer)
      : parts_(std::move(parts)), segments_(segments), most_(most), finer_(std::move(finer)) {}

  double worst() const {
    double worst = 0;
    for (const LevelPart& part : parts_) worst = std::max(worst, part.error_px);
    return worst;
  }
  // Replaces each part whose error exceeds `above_px`, until none is left. False: too many segments; nothing changed.
  bool refine(double above_px) {
    std::vector<LevelPart> left, open = parts_;
    std::uint64_t segments = segments_;
    while (!open.empty()) {
      const LevelPart part = open.back();
      open.pop_back();
      if (part.error_px <= above_px) {
        left.push_back(part);
        continue;
      }
      segments -= part.segments;
      for (const LevelPart& below : finer_(part)) {
        segments += below.segments;
        open.push_back(below);
      }
      if (segments > most_ + slackOf(open, above_px)) return false;
    }
    if (segments > most_) return false;
    parts_ = std::move(left);
    segments_ = segments;
    return true;
  }
  // Replaces the parts around the eye, coarsest first, each that fits. The others stay for good.
  void refineAroundEye() {
    std::vector<LevelPart> left, open;
    for (const LevelPart& part : parts_) (std::isinf(part.error_px) ? open : left).push_back(part);
    for (std::size_t i = 0; i < open.size(); ++i) {
      for (const LevelPart& finer : replaced(open[i])) (std::isinf(finer.error_px) ? open : left).push_back(finer);
    }
    parts_ = std::move(left);
  }
  // Replaces single parts, that of the largest error first, each that fits, until no error exceeds `above_px`.
  void refineSingly(double above_px) {
    const auto later = [](const LevelPart& a, const LevelPart& b) {
      return a.error_px != b.error_px ? a.error_px < b.error_px : a.tile > b.tile;
    };
    std::priority_queue<LevelPart, std::vector<LevelPart>, decltype(later)> open(later, std::move(parts_));
    parts_.clear();
    while (!open.empty() && open.top().error_px > above_px) {
      const LevelPart part = open.top();
      open.pop();
      for (const LevelPart& finer : replaced(part)) open.push(finer);
    }
    for (; !open.empty(); open.pop()) settled_.push_back(open.top());
  }
  std::uint64_t segments() const { return segments_; }
  std::vector<LevelPart> take() {
    parts_.insert(parts_.end(), settled_.begin(), settled_.end());
    return std::move(parts_);
  }

 private:
  // The parts below, if they fit in the place of the part. A single one that does not fit may hold more than those
  // below it that are in view: then these. Otherwise the part stays for good, and there are none.
  std::vector<LevelPart> replaced(const LevelPart& part) {
    LevelPart last = part;
    for (;;) {
      std::vector<LevelPart> below = finer_(last);
      std::uint64_t sum = 0;
      for (const LevelPart& finer : below) sum += finer.segments;
      if (segments_ - part.segments + sum <= most_) {
        segments_ += sum - part.segments;
        return below;
      }
      if (below.size() != 1 || !below[0].level || below[0].tile == last.tile) break;
      last = below[0];
    }
    settled_.push_back(part);
    return {};
  }
  // Segments that further replacement may remove again.
  static std::uint64_t slackOf(const std::vector<LevelPart>& open, double above_px) {
    std::uint64_t sum = 0;
    for (const LevelPart& part : open)
      if (part.error_px > above_px) sum += part.segments;
    return sum;
  }

  std::vector<LevelPart> parts_, settled_;
  std::uint64_t segments_, most_;
  Finer finer_;
};

}  // namespace filiform::internal
