// The branches of a hub that point most nearly to the hand, found by looking at a part of them in each tick.
//
// A hub is a node with more branches than a tick can test. Straight branches that point to the hand lead nearest to it.
// To look at a branch costs a quarter of a test: it takes no label and no search for the far node. Thread rule: haptic
// thread only; noexcept, without allocation. A value: copies restore an earlier state.
#pragma once

#include "solver/graph/internal/working_graph.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <span>
#include <utility>

namespace filiform::internal {

class HubBranches {
 public:
  static constexpr std::uint32_t kKept = 16, kLooksInTest = 4;

  // Looks at up to `most` further branches of the open node, in turn, and again at those kept. Forgets another node.
  // Returns the number of tests that this costs. O(most).
  std::uint32_t look(const WorkingGraph::Node& hub, const Vector3d& h_W, std::uint32_t most) noexcept {
    if (hub.id != id_) {
      *this = HubBranches{};
      id_ = hub.id;
    }
    const std::array<std::uint32_t, kKept> kept = kept_;
    const std::uint32_t before = std::exchange(count_, 0);
    most = std::min(most, hub.degree);
    for (std::uint32_t i = 0; i < before; ++i)
      if (kept[i] < hub.degree) rank(hub, h_W, kept[i]);
    for (std::uint32_t i = 0; i < most; ++i, ++next_) {
      if (next_ >= hub.degree) next_ = 0;
      if (std::find(kept.begin(), kept.begin() + before, next_) == kept.begin() + before) rank(hub, h_W, next_);
    }
    return (most + before + kLooksInTest - 1) / kLooksInTest;
  }
  // Positions in the hub's list of branches, the best direction first.
  std::span<const std::uint32_t> best() const noexcept { return {kept_.data(), count_}; }

 private:
  void rank(const WorkingGraph::Node& hub, const Vector3d& h_W, std::uint32_t at) noexcept {
    const Tile& tile = *hub.tile;
    const std::uint32_t segment = tile.incident(hub.node)[at], child = tile.child(segment);
    const Vector3d way_W = tile.position_W(child == hub.node ? tile.parent(segment) : child) - hub.p_W;
    const double along = way_W.dot(h_W - hub.p_W), length2 = way_W.squaredNorm();
    const double value = length2 > 0 ? along * std::abs(along) / length2 : 0;  // as the cosine, without a root
    if (count_ == kKept && !(value > value_[kKept - 1])) return;
    std::uint32_t i = count_ < kKept ? count_++ : kKept - 1;
    for (; i > 0 && value > value_[i - 1]; --i) {
      value_[i] = value_[i - 1];
      kept_[i] = kept_[i - 1];
    }
    value_[i] = value;
    kept_[i] = at;
  }

  NodeId id_{UINT32_MAX, UINT32_MAX};
  std::uint32_t next_ = 0, count_ = 0;
  std::array<std::uint32_t, kKept> kept_{};
  std::array<double, kKept> value_{};
};

}  // namespace filiform::internal
