#include "tools/bench/midpoint_peers.h"

#include "index/closest_point.h"

#include <cmath>
#include <cstdint>
#include <limits>
#include <memory>

#include <flann/flann.hpp>

#ifdef FILIFORM_BENCH_NANOFLANN
#include <nanoflann.hpp>
#endif

namespace filiform::tools {

namespace {

constexpr double kLongest_um = 4;

struct Pieces {
  const std::vector<SegmentEnds>& segments;
  std::vector<double> middles;       // x, y, z
  std::vector<std::uint32_t> owner;  // its segment
  double half_um = 0;                // of the longest piece

  // As nanoflann asks for points.
  std::size_t kdtree_get_point_count() const { return owner.size(); }
  double kdtree_get_pt(std::size_t i, std::size_t axis) const { return middles[3 * i + axis]; }
  template <class Box>
  bool kdtree_get_bbox(Box&) const {
    return false;
  }
};

std::shared_ptr<Pieces> cut(const std::vector<SegmentEnds>& segments) {
  auto pieces = std::make_shared<Pieces>(Pieces{segments, {}, {}});
  for (std::size_t s = 0; s < segments.size(); ++s) {
    const auto& [a_W, b_W] = segments[s];
    const double length = (b_W - a_W).norm();
    const auto count = static_cast<int>(std::max(1.0, std::ceil(length / kLongest_um)));
    pieces->half_um = std::max(pieces->half_um, 0.5 * length / count);
    for (int i = 0; i < count; ++i) {
      const Vector3d middle_W = a_W + ((i + 0.5) / count) * (b_W - a_W);
      pieces->middles.insert(pieces->middles.end(), {middle_W.x(), middle_W.y(), middle_W.z()});
      pieces->owner.push_back(static_cast<std::uint32_t>(s));
    }
  }
  return pieces;
}

// What both libraries put their finds into: it asks for every middle that could belong to a nearer segment.
class Refinement {
 public:
  Refinement(const Pieces& pieces, const Vector3d& h_W) : pieces_(pieces), h_W_(h_W) {}

  double worst() const { return worst_; }
  double squared() const { return best_; }
  void offer(std::size_t piece) {
    const auto& [a_W, b_W] = pieces_.segments[pieces_.owner[piece]];
    const double squared = closestPoint(a_W, b_W, h_W_).squared_distance;
    if (squared >= best_) return;
    best_ = squared;
    const double reach = std::sqrt(best_) + pieces_.half_um + 1e-9;
    worst_ = reach * reach;
  }

 private:
  const Pieces& pieces_;
  const Vector3d& h_W_;
  double best_ = std::numeric_limits<double>::infinity(), worst_ = best_;
};

class FlannResult final : public flann::ResultSet<double> {
 public:
  explicit FlannResult(Refinement& refinement) : refinement_(refinement) {}
  bool full() const override { return true; }
  void addPoint(double squared, std::size_t index) override {
    if (squared < refinement_.worst()) refinement_.offer(index);
  }
  double worstDist() const override { return refinement_.worst(); }

 private:
  Refinement& refinement_;
};

}  // namespace

Peer flannPeer() {
  return {"FLANN", FLANN_VERSION_, [](const std::vector<SegmentEnds>& segments) -> SquaredDistance {
            using Tree = flann::KDTreeSingleIndex<flann::L2_Simple<double>>;
            const std::shared_ptr<Pieces> pieces = cut(segments);
            auto tree = std::make_shared<Tree>(flann::Matrix<double>(pieces->middles.data(), pieces->owner.size(), 3),
                                               flann::KDTreeSingleIndexParams(10));
            tree->buildIndex();
            return [pieces, tree](const Vector3d& h_W) {
              Refinement refinement(*pieces, h_W);
              FlannResult result(refinement);
              tree->findNeighbors(result, h_W.data(), flann::SearchParams(flann::FLANN_CHECKS_UNLIMITED));
              return refinement.squared();
            };
          }};
}

#ifdef FILIFORM_BENCH_NANOFLANN

namespace {

class NanoflannResult {
 public:
  explicit NanoflannResult(Refinement& refinement) : refinement_(refinement) {}
  bool full() const { return true; }
  bool addPoint(double squared, std::size_t index) {
    if (squared < refinement_.worst()) refinement_.offer(index);
    return true;
  }
  double worstDist() const { return refinement_.worst(); }

 private:
  Refinement& refinement_;
};

}  // namespace

Peer nanoflannPeer() {
  std::string version = std::to_string(NANOFLANN_VERSION / 256);
  version += "." + std::to_string(NANOFLANN_VERSION / 16 % 16);
  version += "." + std::to_string(NANOFLANN_VERSION % 16);
  return {"nanoflann", version, [](const std::vector<SegmentEnds>& segments) -> SquaredDistance {
            using Tree = nanoflann::KDTreeSingleIndexAdaptor<nanoflann::L2_Simple_Adaptor<double, Pieces>, Pieces, 3>;
            const std::shared_ptr<Pieces> pieces = cut(segments);
            auto tree = std::make_shared<Tree>(3, *pieces, nanoflann::KDTreeSingleIndexAdaptorParams(10));
            tree->buildIndex();
            return [pieces, tree](const Vector3d& h_W) {
              Refinement refinement(*pieces, h_W);
              NanoflannResult result(refinement);
              tree->findNeighbors(result, h_W.data(), nanoflann::SearchParams());
              return refinement.squared();
            };
          }};
}

#else

Peer nanoflannPeer() { return {"nanoflann", "", {}}; }

#endif

}  // namespace filiform::tools
