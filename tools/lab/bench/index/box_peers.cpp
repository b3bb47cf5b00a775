#include "tools/lab/bench/index/box_peers.h"

#include "index/geometry/closest_point.h"

#include <cstdint>
#include <iterator>
#include <limits>
#include <memory>
#include <utility>

#include <CGAL/AABB_segment_primitive.h>
#include <CGAL/AABB_traits.h>
#include <CGAL/AABB_tree.h>
#include <CGAL/Simple_cartesian.h>
#include <CGAL/version.h>

#ifdef FILIFORM_BENCH_BOOST
#define BOOST_ALLOW_DEPRECATED_HEADERS  // Boost includes its own deprecated headers
#include <boost/geometry.hpp>
#include <boost/geometry/index/rtree.hpp>
#include <boost/version.hpp>
#endif

namespace filiform::tools {

namespace {

using Kernel = CGAL::Simple_cartesian<double>;
using CgalSegments = std::vector<Kernel::Segment_3>;

Kernel::Point_3 cgalPoint(const Vector3d& p) { return {p.x(), p.y(), p.z()}; }

// Cached: CGAL::Tag_true or Tag_false, whether the tree holds a copy of each segment. hint_step: a query starts from
// the nearest of the reference points, one for each hint_step segments; 0: from the first segment.
template <typename Cached>
PeerSetting cgalSetting(const std::string& name, std::size_t hint_step) {
  struct Cgal {
    CgalSegments segments;
    CGAL::AABB_tree<CGAL::AABB_traits<Kernel, CGAL::AABB_segment_primitive<Kernel, CgalSegments::iterator, Cached>>>
        tree;
  };
  return {name, false, [hint_step](const std::vector<SegmentEnds>& segments) -> SquaredDistance {
            auto cgal = std::make_shared<Cgal>();
            cgal->segments.reserve(segments.size());
            for (const auto& [a_W, b_W] : segments) {
              // CGAL accepts no segment of length zero. Samples without links get a length too small to matter.
              const Vector3d end_W = a_W == b_W ? Vector3d(b_W + Vector3d(1e-9, 0, 0)) : b_W;
              cgal->segments.emplace_back(cgalPoint(a_W), cgalPoint(end_W));
            }
            cgal->tree.insert(cgal->segments.begin(), cgal->segments.end());
            if (hint_step != 1) cgal->tree.do_not_accelerate_distance_queries();
            cgal->tree.build();
            if (hint_step == 1) {
              cgal->tree.accelerate_distance_queries();
            } else if (hint_step > 1) {
              std::vector<Kernel::Point_3> hints;
              for (std::size_t i = 0; i < cgal->segments.size(); i += hint_step)
                hints.push_back(cgal->segments[i].source());
              cgal->tree.accelerate_distance_queries(hints.begin(), hints.end());
            }
            return [cgal](const Vector3d& h_W) { return cgal->tree.squared_distance(cgalPoint(h_W)); };
          }};
}

}  // namespace

Peer cgalPeer() {
  return racedWith(
      {"CGAL",
       CGAL_VERSION_STR,
       {cgalSetting<CGAL::Tag_false>("hints: all segments", 1),
        cgalSetting<CGAL::Tag_true>("hints: all segments, copies in the tree", 1),
        cgalSetting<CGAL::Tag_true>("hints: one segment in 8, copies in the tree", 8),
        cgalSetting<CGAL::Tag_false>("hints: one segment in 8", 8),
        cgalSetting<CGAL::Tag_false>("hints: one segment in 64", 64), cgalSetting<CGAL::Tag_false>("no hints", 0)}},
      "hints: all segments, copies in the tree");
}

#ifdef FILIFORM_BENCH_BOOST

namespace {

namespace bg = boost::geometry;
namespace bgi = boost::geometry::index;
using BoostPoint = bg::model::point<double, 3, bg::cs::cartesian>;
using BoostSegment = bg::model::segment<BoostPoint>;
using BoostBox = bg::model::box<BoostPoint>;

enum class Filling { packed, inserted };  // all segments at once, or one by one
enum class Asking { query, iterator };    // query() or qbegin()

BoostPoint boostPoint(const Vector3d& p) { return {p.x(), p.y(), p.z()}; }

template <typename Parameters>
PeerSetting boostSetting(const std::string& name, Filling filling, Asking asking) {
  using Tree = bgi::rtree<BoostSegment, Parameters>;
  return {name, false, [filling, asking](const std::vector<SegmentEnds>& segments) -> SquaredDistance {
            std::vector<BoostSegment> all;
            all.reserve(segments.size());
            for (const auto& [a_W, b_W] : segments) all.emplace_back(boostPoint(a_W), boostPoint(b_W));
            auto tree = std::make_shared<Tree>();
            if (filling == Filling::packed)
              *tree = Tree(all);
            else
              for (const BoostSegment& segment : all) tree->insert(segment);
            if (asking == Asking::query)
              return [tree](const Vector3d& h_W) {
                const BoostPoint p = boostPoint(h_W);
                BoostSegment found[1];
                tree->query(bgi::nearest(p, 1), found);
                return bg::comparable_distance(p, found[0]);
              };
            return [tree](const Vector3d& h_W) {
              const BoostPoint p = boostPoint(h_W);
              double squared = 0;
              for (auto it = tree->qbegin(bgi::nearest(p, 1)); it != tree->qend(); ++it)
                squared = bg::comparable_distance(p, *it);
              return squared;
            };
          }};
}

// Boxes that hold segment numbers. Boxes come in the order of their distance, until a box is farther than the best
// segment.
template <typename Parameters>
PeerSetting boostBoxes(const std::string& name) {
  using Value = std::pair<BoostBox, std::uint32_t>;
  using Tree = bgi::rtree<Value, Parameters>;
  return {name, true, [](const std::vector<SegmentEnds>& segments) -> SquaredDistance {
            std::vector<Value> all;
            all.reserve(segments.size());
            for (const auto& [a_W, b_W] : segments)
              all.emplace_back(BoostBox(boostPoint(a_W.cwiseMin(b_W)), boostPoint(a_W.cwiseMax(b_W))),
                               static_cast<std::uint32_t>(all.size()));
            const auto tree = std::make_shared<const Tree>(all);
            return [tree, &segments](const Vector3d& h_W) {
              const BoostPoint p = boostPoint(h_W);
              double squared = std::numeric_limits<double>::infinity();
              // The tree sorts all the neighbours that a query asks for, so ask for few at first.
              for (std::size_t most = 16;; most *= 8) {
                for (auto it = tree->qbegin(bgi::nearest(p, static_cast<unsigned>(most))); it != tree->qend(); ++it) {
                  if (bg::comparable_distance(p, it->first) >= squared) return squared;
                  const auto& [a_W, b_W] = segments[it->second];
                  squared = std::min(squared, closestPoint(a_W, b_W, h_W).squared_distance);
                }
                if (most >= segments.size()) return squared;
              }
            };
          }};
}

}  // namespace

Peer boostPeer() {
  constexpr auto kPacked = Filling::packed, kInserted = Filling::inserted;
  constexpr auto kQuery = Asking::query, kIterator = Asking::iterator;
  return racedWith({"Boost",
                    BOOST_LIB_VERSION,
                    {boostSetting<bgi::linear<4>>("linear<4>, packed, query()", kPacked, kQuery),
                     boostSetting<bgi::linear<6>>("linear<6>, packed, query()", kPacked, kQuery),
                     boostSetting<bgi::linear<8>>("linear<8>, packed, query()", kPacked, kQuery),
                     boostSetting<bgi::linear<12>>("linear<12>, packed, query()", kPacked, kQuery),
                     boostSetting<bgi::linear<16>>("linear<16>, packed, query()", kPacked, kQuery),
                     boostSetting<bgi::linear<32>>("linear<32>, packed, query()", kPacked, kQuery),
                     boostSetting<bgi::quadratic<8>>("quadratic<8>, packed, query()", kPacked, kQuery),
                     boostSetting<bgi::rstar<6>>("rstar<6>, packed, query()", kPacked, kQuery),
                     boostSetting<bgi::rstar<8>>("rstar<8>, packed, query()", kPacked, kQuery),
                     boostSetting<bgi::linear<8>>("linear<8>, packed, qbegin()", kPacked, kIterator),
                     boostSetting<bgi::linear<16>>("linear<16>, packed, qbegin()", kPacked, kIterator),
                     boostSetting<bgi::linear<8>>("linear<8>, inserted, query()", kInserted, kQuery),
                     boostSetting<bgi::quadratic<8>>("quadratic<8>, inserted, query()", kInserted, kQuery),
                     boostSetting<bgi::rstar<8>>("rstar<8>, inserted, query()", kInserted, kQuery),
                     boostBoxes<bgi::linear<8>>("linear<8>, packed, boxes, qbegin()")}},
                   "linear<8>, packed, query()");
}

#else

Peer boostPeer() { return {"Boost", "", {}}; }

#endif

}  // namespace filiform::tools
