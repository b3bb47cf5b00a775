#include "index/query/internal/landmark_hint.h"

#include <algorithm>
#include <mutex>
#include <numeric>
#include <unordered_set>

#include <flann/algorithms/dist.h>
#include <flann/algorithms/kdtree_single_index.h>
#include <flann/general.h>

namespace filiform {
namespace {

// FLANN inserts results into a sorted array one by one. For more results, a scan of all landmarks is faster.
constexpr std::size_t kMaxFromTree = 1024;

}  // namespace

struct LandmarkHint::Impl {
  using Tree = flann::KDTreeSingleIndex<flann::L2_3D<double>>;

  const Grid grid;
  const Landmarks& landmarks;
  std::unique_ptr<Tree> tree;  // nullptr for an empty set

  explicit Impl(const TileStore& store) : grid(store.grid()), landmarks(store.landmarks()) {
    const std::size_t n = landmarks.points.size();
    if (n == 0) return;
    std::vector<double> points(3 * n);
    for (std::size_t i = 0; i < n; ++i) {
      const Vector3d p_W = grid.toWorld(landmarks.points[i]);
      std::copy(p_W.data(), p_W.data() + 3, &points[3 * i]);
    }
    // The tree keeps its own reordered copy of the points.
    tree = std::make_unique<Tree>(flann::Matrix<double>(points.data(), n, 3), flann::KDTreeSingleIndexParams(10, true));
    tree->buildIndex();
  }

  // The nearest landmark of each segment, nearest first.
  std::vector<Guess> distinct(const Vector3d& h_W, const std::vector<std::size_t>& indices) const {
    std::vector<Guess> guesses;
    guesses.reserve(indices.size());
    for (const std::size_t i : indices) {
      const Vector3d p_W = grid.toWorld(landmarks.points[i]);
      guesses.push_back({(p_W - h_W).norm(), p_W, landmarks.segments[i], landmarks.t[i]});
    }
    if (guesses.size() == 1) return guesses;
    std::sort(guesses.begin(), guesses.end(), [](const Guess& a, const Guess& b) {
      return a.distance != b.distance ? a.distance < b.distance
             : a.segment != b.segment ? a.segment < b.segment
                                      : a.t < b.t;
    });
    std::unordered_set<std::uint64_t> seen;
    std::erase_if(guesses, [&](const Guess& g) { return !seen.insert(g.segment.key()).second; });
    return guesses;
  }

  // At least k distinct segments. Fewer if they would need more than kMaxFromTree landmarks, since many landmarks may
  // lie on one segment.
  std::vector<Guess> fromTree(const Vector3d& h_W, std::size_t k) const {
    const std::size_t most = std::min(landmarks.points.size(), kMaxFromTree);
    std::vector<Guess> guesses;
    if (tree == nullptr || k == 0) return guesses;
    for (std::size_t wanted = k >= most ? most : std::min(most, k == 1 ? k : k + k / 2 + 8);;
         wanted = std::min(most, 4 * wanted)) {
      flann::KNNSimpleResultSet<double> found(wanted);
      tree->findNeighbors(found, h_W.data(), flann::SearchParams(flann::FLANN_CHECKS_UNLIMITED));
      std::vector<std::size_t> indices(found.size());
      std::vector<double> squared(found.size());
      found.copy(indices.data(), squared.data(), found.size(), true);
      guesses = distinct(h_W, indices);
      if (guesses.size() >= k || wanted == most) return guesses;
    }
  }
};

LandmarkHint::LandmarkHint(const TileStore& store) : store_(store) {}
LandmarkHint::~LandmarkHint() = default;

const LandmarkHint::Impl& LandmarkHint::built() const {
  return built_.get([this] { return std::make_unique<const Impl>(store_); });
}

std::vector<LandmarkHint::Guess> LandmarkHint::nearest(const Vector3d& h_W, std::size_t k) const {
  const Impl& impl = built();
  std::vector<Guess> guesses = impl.fromTree(h_W, k);
  const std::size_t n = impl.landmarks.points.size();
  if (guesses.size() < k && n > kMaxFromTree) {
    std::vector<std::size_t> all(n);
    std::iota(all.begin(), all.end(), std::size_t{0});
    guesses = impl.distinct(h_W, all);
  }
  if (guesses.size() > k) guesses.resize(k);
  return guesses;
}

double LandmarkHint::covering_radius_um() const { return built().landmarks.covering_radius_um; }

}  // namespace filiform
