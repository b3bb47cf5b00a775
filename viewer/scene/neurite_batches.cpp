#include "viewer/scene/neurite_batches.h"

#include "index/errors.h"
#include "index/text.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include <Eigen/Geometry>

namespace filiform {

namespace {

constexpr float kNoRadius = -1;

bool isDrawnBefore(const DrawnSegment& a, const DrawnSegment& b) {
  if (isBall(a) != isBall(b)) return isBall(a);
  return std::max(a.a_radius_um, a.b_radius_um) > std::max(b.a_radius_um, b.b_radius_um);
}

}  // namespace

const char* toString(ColourBy colouring) noexcept {
  switch (colouring) {
    case ColourBy::cell:
      return "cell";
    case ColourBy::type:
      return "type";
    case ColourBy::depth:
      return "depth";
    case ColourBy::radius:
      return "radius";
    case ColourBy::tile:
      return "tile";
  }
  return "";
}

std::optional<ColourBy> colouringNamed(const std::string& name) {
  for (const ColourBy colouring : kColourings)
    if (name == toString(colouring)) return colouring;
  return std::nullopt;
}

float drawnRadius(float radius_um, std::uint16_t type, bool* replaced) noexcept {
  const bool soma = type == kSomaType;
  const bool plausible = radius_um >= kThinnest_um && radius_um <= (soma ? kThickestSoma_um : kThickest_um);
  if (replaced != nullptr) *replaced = !plausible;
  if (plausible) return radius_um;
  return soma ? kDrawnUnknownSoma_um : kDrawnUnknown_um;
}

std::vector<std::uint32_t> cellsWithOpenNodes(const Tile& tile) {
  std::vector<bool> closed(tile.node_count(), false);
  for (std::uint32_t s = 0; s < tile.segment_count(); ++s) closed[tile.child(s)] = true;
  std::vector<std::uint32_t> cells;
  for (std::uint32_t s = 0; s < tile.segment_count(); ++s)
    if (!closed[tile.parent(s)] && (cells.empty() || cells.back() != tile.segmentId(s).cell))
      cells.push_back(tile.segmentId(s).cell);
  std::sort(cells.begin(), cells.end());
  cells.erase(std::unique(cells.begin(), cells.end()), cells.end());
  return cells;
}

namespace {

// Makes the batch of one tile.
class BatchMaker {
 public:
  BatchMaker(const Tile& tile, const TileAppearance& appearance, const BatchOptions& options)
      : tile_(tile),
        appearance_(appearance),
        options_(options),
        radii_(tile.node_count(), kNoRadius),
        is_soma_(tile.node_count(), false) {}

  NeuriteBatch make() {
    if (tile_.node_count() == 0) return {};
    batch_.by_cell = true;
    batch_.tile = tile_.id();
    readRadii();
    GridBox box;
    for (std::uint32_t n = 0; n < tile_.node_count(); ++n) box.extend(tile_.gridPoint(n));
    lo_W_ = tile_.grid().toWorld(box.lo);
    hi_W_ = tile_.grid().toWorld(box.hi);
    batch_.origin_W = (lo_W_ + hi_W_) / 2;
    batch_.segments.reserve(tile_.owned_count());
    std::size_t owned = 0;
    for (std::uint32_t s = 0; s < tile_.segment_count(); ++s) {
      if (!tile_.owned(s)) continue;
      const std::uint16_t type = appearance_.types[owned++];
      if (options_.only_cell != UINT32_MAX && tile_.segmentId(s).cell != options_.only_cell) continue;
      addSegment(s, type);
    }
    if (batch_.segments.empty()) return std::move(batch_);
    const Vector3d rim = Vector3d::Constant(batch_.largest_radius_um);
    batch_.lo_W = lo_W_ - rim;
    batch_.hi_W = hi_W_ + rim;
    return std::move(batch_);
  }

 private:
  const Soma* somaAt(std::uint32_t node) const {
    if (options_.somata == nullptr || options_.somata->empty()) return nullptr;
    const auto found = options_.somata->find(tile_.nodeId(node));
    return found != options_.somata->end() ? found->second.get() : nullptr;
  }

  void readRadii() {
    std::size_t owned = 0;
    for (std::uint32_t s = 0; s < tile_.segment_count(); ++s) {
      if (!tile_.owned(s)) continue;
      bool replaced = false;
      const std::uint32_t child = tile_.child(s);
      radii_[child] = drawnRadius(appearance_.radii_um[owned], appearance_.types[owned], &replaced);
      is_soma_[child] = appearance_.types[owned] == kSomaType;
      if (replaced && somaAt(child) == nullptr) ++batch_.implausible_radii;
      ++owned;
    }
  }

  void put(const Vector3d& p_W, float* p_um) const {
    const Vector3d p = p_W - batch_.origin_W;
    for (int axis = 0; axis < 3; ++axis) p_um[axis] = static_cast<float>(p[axis]);
  }

  void add(const DrawnSegment& segment) {
    batch_.largest_radius_um = std::max({batch_.largest_radius_um, segment.a_radius_um, segment.b_radius_um});
    batch_.segments.push_back(segment);
  }

  // Adds a sphere at the soma of segment s.
  void addBall(std::uint32_t s, const Vector3d& centre_W, float radius_um) {
    DrawnSegment ball{};
    put(centre_W, ball.a_um);
    std::copy_n(ball.a_um, 3, ball.b_um);
    ball.a_radius_um = ball.b_radius_um = radius_um;
    ball.paint = ownerPaint(tile_.segmentId(s).cell, kSomaType);
    lo_W_ = lo_W_.cwiseMin(centre_W);
    hi_W_ = hi_W_.cwiseMax(centre_W);
    add(ball);
  }

  void addSphere(std::uint32_t s, const Soma& sphere) {
    if (std::find(spheres_.begin(), spheres_.end(), &sphere) != spheres_.end()) return;
    bool replaced = false;
    addBall(s, sphere.centre_um, drawnRadius(static_cast<float>(sphere.radius_um), kSomaType, &replaced));
    if (replaced) ++batch_.implausible_radii;
    spheres_.push_back(&sphere);
  }

  // Draws a root of type soma as a ball; another root gives the segment its radius.
  void addRoot(std::uint32_t s, DrawnSegment& segment) {
    const std::uint32_t parent = tile_.parent(s);
    const auto root = options_.roots->find(tile_.nodeId(parent));
    if (root == options_.roots->end()) return;
    const float radius_um = drawnRadius(root->second.radius_um, root->second.type);
    if (root->second.type != kSomaType) {
      segment.b_radius_um = radius_um;
      return;
    }
    if (std::find(balls_.begin(), balls_.end(), parent) == balls_.end())
      addBall(s, tile_.position_W(parent), radius_um);
    balls_.push_back(parent);
  }

  void addSegment(std::uint32_t s, std::uint16_t type) {
    const std::uint32_t child = tile_.child(s), parent = tile_.parent(s);
    const Soma* const sphere = somaAt(parent);
    if (sphere != nullptr) addSphere(s, *sphere);
    if (sphere != nullptr && somaAt(child) == sphere) return;
    DrawnSegment segment{};
    put(tile_.position_W(child), segment.a_um);
    put(tile_.position_W(parent), segment.b_um);
    segment.a_radius_um = radii_[child];
    segment.b_radius_um = radii_[parent] != kNoRadius ? radii_[parent] : radii_[child];
    if (options_.roots != nullptr && radii_[parent] == kNoRadius && sphere == nullptr) addRoot(s, segment);
    // In many files a neurite begins at the middle of the soma: it must not widen into a cone as thick as the soma.
    if (is_soma_[parent] && !is_soma_[child]) segment.b_radius_um = segment.a_radius_um;
    segment.paint = ownerPaint(tile_.segmentId(s).cell, type);
    add(segment);
  }

  const Tile& tile_;
  const TileAppearance& appearance_;
  const BatchOptions& options_;
  std::vector<float> radii_;  // of nodes; kNoRadius: of a node that is no owned segment's child
  std::vector<bool> is_soma_;
  Vector3d lo_W_ = Vector3d::Zero(), hi_W_ = Vector3d::Zero();
  NeuriteBatch batch_;
  std::vector<std::uint32_t> balls_;  // roots that are drawn as spheres
  std::vector<const Soma*> spheres_;  // somata that are drawn
};

}  // namespace

NeuriteBatch makeBatch(const Tile& tile, const TileAppearance& appearance, const BatchOptions& options) {
  return BatchMaker(tile, appearance, options).make();
}

void append(NeuriteBatch& batch, const NeuriteBatch& more) {
  if (more.segments.empty()) return;
  if (batch.segments.empty()) {
    const std::uint64_t implausible = batch.implausible_radii;
    batch = more;
    batch.implausible_radii += implausible;
    return;
  }
  const Eigen::Vector3f shift = (more.origin_W - batch.origin_W).cast<float>();
  batch.lo_W = batch.lo_W.cwiseMin(more.lo_W);
  batch.hi_W = batch.hi_W.cwiseMax(more.hi_W);
  batch.largest_radius_um = std::max(batch.largest_radius_um, more.largest_radius_um);
  batch.implausible_radii += more.implausible_radii;
  for (DrawnSegment segment : more.segments) {
    for (int axis = 0; axis < 3; ++axis) {
      segment.a_um[axis] += shift[axis];
      segment.b_um[axis] += shift[axis];
    }
    batch.segments.push_back(segment);
  }
}

bool isBall(const DrawnSegment& segment) noexcept {
  return std::equal(segment.a_um, segment.a_um + 3, segment.b_um) && segment.a_radius_um == segment.b_radius_um;
}

void cutIntoBlocks(NeuriteBatch& batch, std::size_t most_segments) {
  using Place = std::vector<DrawnSegment>::iterator;
  batch.blocks.clear();
  if (batch.segments.size() <= most_segments) return;
  const auto boxOf = [](Place begin, Place end, double room_um) {
    Eigen::AlignedBox<double, 3> box;
    for (Place s = begin; s != end; ++s) {
      const Vector3d rim = Vector3d::Constant(std::max(s->a_radius_um, s->b_radius_um) + room_um);
      for (const float* const p : {s->a_um, s->b_um}) {
        const Vector3d at(p[0], p[1], p[2]);
        box.extend(at - rim).extend(at + rim);
      }
    }
    return box;
  };
  const auto cut = [&](const auto& self, Place begin, Place end) -> void {
    if (static_cast<std::size_t>(end - begin) <= most_segments) {
      const Eigen::AlignedBox<double, 3> box = boxOf(begin, end, batch.pixel_um);
      batch.blocks.push_back({static_cast<std::size_t>(end - batch.segments.begin()), batch.origin_W + box.min(),
                              batch.origin_W + box.max()});
      return;
    }
    int axis = 0;
    boxOf(begin, end, 0).sizes().maxCoeff(&axis);
    const Place middle = begin + (end - begin) / 2;
    std::nth_element(begin, middle, end, [axis](const DrawnSegment& a, const DrawnSegment& b) {
      return a.a_um[axis] + a.b_um[axis] < b.a_um[axis] + b.b_um[axis];
    });
    self(self, begin, middle);
    self(self, middle, end);
  };
  cut(cut, batch.segments.begin(), batch.segments.end());
}

namespace {

// Calls `visit` with the segments of each block.
template <class Segments, class Visit>
void forEachBlock(Segments& segments, const std::vector<NeuriteBatch::Block>& blocks, const Visit& visit) {
  auto begin = segments.begin();
  for (const NeuriteBatch::Block& block : blocks) {
    const auto end = segments.begin() + static_cast<std::ptrdiff_t>(block.end);
    visit(std::exchange(begin, end), end);
  }
  if (begin != segments.end()) visit(begin, segments.end());
}

}  // namespace

void sortForDrawing(NeuriteBatch& batch) {
  forEachBlock(batch.segments, batch.blocks,
               [](const auto& begin, const auto& end) { std::stable_sort(begin, end, isDrawnBefore); });
}
bool isSortedForDrawing(const NeuriteBatch& batch) {
  bool sorted = true;
  forEachBlock(batch.segments, batch.blocks,
               [&](const auto& begin, const auto& end) { sorted &= std::is_sorted(begin, end, isDrawnBefore); });
  return sorted;
}

}  // namespace filiform
