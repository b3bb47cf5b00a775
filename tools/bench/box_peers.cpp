#include "tools/bench/box_peers.h"

#include <memory>

#include <CGAL/AABB_segment_primitive.h>
#include <CGAL/AABB_traits.h>
#include <CGAL/AABB_tree.h>
#include <CGAL/Simple_cartesian.h>
#include <CGAL/version.h>

#ifdef FILIFORM_BENCH_BOOST
#define BOOST_ALLOW_DEPRECATED_HEADERS  // it includes such
#include <boost/geometry.hpp>
#include <boost/geometry/index/rtree.hpp>
#include <boost/version.hpp>
#endif

namespace filiform::tools {

namespace {

using Kernel = CGAL::Simple_cartesian<double>;
using CgalSegments = std::vector<Kernel::Segment_3>;
using CgalTree =
    CGAL::AABB_tree<CGAL::AABB_traits<Kernel, CGAL::AABB_segment_primitive<Kernel, CgalSegments::iterator>>>;

Kernel::Point_3 cgalPoint(const Vector3d& p) { return {p.x(), p.y(), p.z()}; }

struct Cgal {
  CgalSegments segments;
  CgalTree tree;
};

}  // namespace

Peer cgalPeer() {
  return {"CGAL", CGAL_VERSION_STR, [](const std::vector<SegmentEnds>& segments) -> SquaredDistance {
            auto cgal = std::make_shared<Cgal>();
            cgal->segments.reserve(segments.size());
            for (const auto& [a_W, b_W] : segments) {
              // It takes none of length zero: samples without links get a length that cannot be told from it.
              const Vector3d end_W = a_W == b_W ? Vector3d(b_W + Vector3d(1e-9, 0, 0)) : b_W;
              cgal->segments.emplace_back(cgalPoint(a_W), cgalPoint(end_W));
            }
            cgal->tree.insert(cgal->segments.begin(), cgal->segments.end());
            cgal->tree.build();
            cgal->tree.accelerate_distance_queries();
            return [cgal](const Vector3d& h_W) { return cgal->tree.squared_distance(cgalPoint(h_W)); };
          }};
}

#ifdef FILIFORM_BENCH_BOOST

namespace {

namespace bg = boost::geometry;
using BoostPoint = bg::model::point<double, 3, bg::cs::cartesian>;
using BoostSegment = bg::model::segment<BoostPoint>;
using BoostTree = bg::index::rtree<BoostSegment, bg::index::linear<16>>;

}  // namespace

Peer boostPeer() {
  return {"Boost", BOOST_LIB_VERSION, [](const std::vector<SegmentEnds>& segments) -> SquaredDistance {
            std::vector<BoostSegment> packed;
            packed.reserve(segments.size());
            for (const auto& [a_W, b_W] : segments)
              packed.emplace_back(BoostPoint(a_W.x(), a_W.y(), a_W.z()), BoostPoint(b_W.x(), b_W.y(), b_W.z()));
            const auto tree = std::make_shared<const BoostTree>(packed);  // from all at once: it packs them
            return [tree](const Vector3d& h_W) {
              const BoostPoint p(h_W.x(), h_W.y(), h_W.z());
              double squared = 0;
              for (auto it = tree->qbegin(bg::index::nearest(p, 1)); it != tree->qend(); ++it)
                squared = bg::comparable_distance(p, *it);
              return squared;
            };
          }};
}

#else

Peer boostPeer() { return {"Boost", "", {}}; }

#endif

}  // namespace filiform::tools
