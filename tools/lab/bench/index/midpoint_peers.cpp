#include "tools/lab/bench/index/midpoint_peers.h"

#include "index/geometry/closest_point.h"
#include "tools/lab/bench/bench.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>
#include <memory>
#include <type_traits>
#include <utility>

#include <flann/flann.hpp>

#ifdef FILIFORM_BENCH_NANOFLANN
#include <nanoflann.hpp>
#endif

namespace filiform::tools {

namespace {

template <typename Scalar>
struct Pieces {
  const std::vector<SegmentEnds>& segments;
  std::vector<Scalar> middles;       // x, y, z
  std::vector<std::uint32_t> owner;  // the segment of each middle
  double half_um = 0;                // half the length of the longest piece

  // The interface that nanoflann requires.
  std::size_t kdtree_get_point_count() const { return owner.size(); }
  Scalar kdtree_get_pt(std::size_t i, std::size_t axis) const { return middles[3 * i + axis]; }
  template <class Box>
  bool kdtree_get_bbox(Box&) const {
    return false;
  }
};

template <typename Scalar>
std::shared_ptr<Pieces<Scalar>> cut(const std::vector<SegmentEnds>& segments, double longest_um) {
  auto pieces = std::make_shared<Pieces<Scalar>>(Pieces<Scalar>{segments, {}, {}});
  for (std::size_t s = 0; s < segments.size(); ++s) {
    const auto& [a_W, b_W] = segments[s];
    const double length = (b_W - a_W).norm();
    const auto count = static_cast<int>(std::max(1.0, std::ceil(length / longest_um)));
    pieces->half_um = std::max(pieces->half_um, 0.5 * length / count);
    for (int i = 0; i < count; ++i) {
      const Vector3d middle_W = a_W + ((i + 0.5) / count) * (b_W - a_W);
      for (int axis = 0; axis < 3; ++axis) pieces->middles.push_back(static_cast<Scalar>(middle_W[axis]));
      pieces->owner.push_back(static_cast<std::uint32_t>(s));
    }
  }
  pieces->middles.shrink_to_fit(), pieces->owner.shrink_to_fit();
  return pieces;
}

// Both libraries put their results into this object. It accepts every middle that may belong to a nearer segment.
template <typename Scalar>
class Refinement {
 public:
  Refinement(const Pieces<Scalar>& pieces, const Vector3d& h_W) : pieces_(pieces), h_W_(h_W) {}

  Scalar worst() const { return worst_; }
  double squared() const { return best_; }
  void offer(std::size_t piece) {
    const auto& [a_W, b_W] = pieces_.segments[pieces_.owner[piece]];
    const double squared = closestPoint(a_W, b_W, h_W_).squared_distance;
    if (squared >= best_) return;
    best_ = squared;
    // In float: rounding of coordinates below 1e4 um, and of the distance.
    const double rounding_um = std::is_same_v<Scalar, float> ? 2e-3 + 1e-6 * std::sqrt(best_) : 1e-9;
    const double reach = std::sqrt(best_) + pieces_.half_um + rounding_um;
    worst_ = static_cast<Scalar>(reach * reach);
  }

 private:
  const Pieces<Scalar>& pieces_;
  const Vector3d& h_W_;
  double best_ = std::numeric_limits<double>::infinity();
  Scalar worst_ = std::numeric_limits<Scalar>::infinity();
};

template <typename Scalar>
class FlannResult final : public flann::ResultSet<Scalar> {
 public:
  explicit FlannResult(Refinement<Scalar>& refinement) : refinement_(refinement) {}
  bool full() const override { return true; }
  void addPoint(Scalar squared, std::size_t index) override {
    if (squared < refinement_.worst()) refinement_.offer(index);
  }
  Scalar worstDist() const override { return refinement_.worst(); }

 private:
  Refinement<Scalar>& refinement_;
};

template <typename Scalar>
std::array<Scalar, 3> coordinates(const Vector3d& h_W) {
  return {static_cast<Scalar>(h_W.x()), static_cast<Scalar>(h_W.y()), static_cast<Scalar>(h_W.z())};
}

// The name of a setting: points in a leaf, length of the pieces, and precision.
std::string settingName(int leaf, double longest_um, bool single) {
  return "leaf " + std::to_string(leaf) + ", pieces of " + shown(longest_um) + " um" + (single ? ", float" : "");
}

constexpr int kLeaves[] = {10, 20, 40};
constexpr double kPieces_um[] = {0.5, 1, 2, 4};
constexpr int kFloatLeaves[] = {20, 40};
constexpr double kFloatPieces_um[] = {0.5, 1, 2};

template <typename Scalar>
PeerSetting flannSetting(int leaf, double longest_um, bool reorder) {
  return {settingName(leaf, longest_um, std::is_same_v<Scalar, float>) + (reorder ? "" : ", not reordered"), true,
          [=](const std::vector<SegmentEnds>& segments) -> SquaredDistance {
            using Tree = flann::KDTreeSingleIndex<flann::L2_Simple<Scalar>>;
            const std::shared_ptr<Pieces<Scalar>> pieces = cut<Scalar>(segments, longest_um);
            auto tree = std::make_shared<Tree>(flann::Matrix<Scalar>(pieces->middles.data(), pieces->owner.size(), 3),
                                               flann::KDTreeSingleIndexParams(leaf, reorder));
            tree->buildIndex();
            return [pieces, tree](const Vector3d& h_W) {
              Refinement<Scalar> refinement(*pieces, h_W);
              FlannResult<Scalar> result(refinement);
              const std::array<Scalar, 3> p = coordinates<Scalar>(h_W);
              tree->findNeighbors(result, p.data(), flann::SearchParams(flann::FLANN_CHECKS_UNLIMITED));
              return refinement.squared();
            };
          }};
}

}  // namespace

Peer flannPeer() {
  Peer peer{"FLANN", FLANN_VERSION_, {}};
  for (const int leaf : kLeaves)
    for (const double longest_um : kPieces_um) peer.settings.push_back(flannSetting<double>(leaf, longest_um, true));
  for (const int leaf : kFloatLeaves)
    for (const double longest_um : kFloatPieces_um)
      peer.settings.push_back(flannSetting<float>(leaf, longest_um, true));
  peer.settings.push_back(flannSetting<double>(10, 4, false));
  return racedWith(std::move(peer), settingName(40, 1, true));
}

#ifdef FILIFORM_BENCH_NANOFLANN

namespace {

template <typename Scalar>
class NanoflannResult {
 public:
  explicit NanoflannResult(Refinement<Scalar>& refinement) : refinement_(refinement) {}
  bool full() const { return true; }
  bool addPoint(Scalar squared, std::size_t index) {
    if (squared < refinement_.worst()) refinement_.offer(index);
    return true;
  }
  Scalar worstDist() const { return refinement_.worst(); }

 private:
  Refinement<Scalar>& refinement_;
};

template <typename Scalar>
PeerSetting nanoflannSetting(int leaf, double longest_um) {
  return {settingName(leaf, longest_um, std::is_same_v<Scalar, float>), true,
          [=](const std::vector<SegmentEnds>& segments) -> SquaredDistance {
            using Points = Pieces<Scalar>;
            using Tree = nanoflann::KDTreeSingleIndexAdaptor<nanoflann::L2_Simple_Adaptor<Scalar, Points>, Points, 3>;
            const std::shared_ptr<Points> pieces = cut<Scalar>(segments, longest_um);
            auto tree = std::make_shared<Tree>(
                3, *pieces, nanoflann::KDTreeSingleIndexAdaptorParams(static_cast<std::size_t>(leaf)));
            tree->buildIndex();
            return [pieces, tree](const Vector3d& h_W) {
              Refinement<Scalar> refinement(*pieces, h_W);
              NanoflannResult<Scalar> result(refinement);
              const std::array<Scalar, 3> p = coordinates<Scalar>(h_W);
              tree->findNeighbors(result, p.data(), nanoflann::SearchParams());
              return refinement.squared();
            };
          }};
}

}  // namespace

Peer nanoflannPeer() {
  std::string version = std::to_string(NANOFLANN_VERSION / 256);
  version += "." + std::to_string(NANOFLANN_VERSION / 16 % 16);
  version += "." + std::to_string(NANOFLANN_VERSION % 16);
  Peer peer{"nanoflann", version, {}};
  for (const int leaf : kLeaves)
    for (const double longest_um : kPieces_um) peer.settings.push_back(nanoflannSetting<double>(leaf, longest_um));
  for (const int leaf : kFloatLeaves)
    for (const double longest_um : kFloatPieces_um) peer.settings.push_back(nanoflannSetting<float>(leaf, longest_um));
  return racedWith(std::move(peer), settingName(20, 1, true));
}

#else

Peer nanoflannPeer() { return {"nanoflann", "", {}}; }

#endif

}  // namespace filiform::tools
