#include "viewer/scene/neurite_batches.h"

#include "index/errors.h"
#include "index/text.h"

#include <algorithm>
#include <cmath>

namespace filiform {

namespace {

constexpr float kNoRadius = -1;

bool isThicker(const DrawnSegment& a, const DrawnSegment& b) {
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

ColourBy colourBy(const std::string& name) {
  std::string choices;
  for (const ColourBy colouring : kColourings) {
    if (name == toString(colouring)) return colouring;
    choices += (choices.empty() ? "" : ", ") + std::string(toString(colouring));
  }
  throw UsageError("--colour-by " + escaped(name) + ": choose one of " + choices);
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

NeuriteBatch makeBatch(const Tile& tile, const TileAppearance& appearance, const BatchOptions& options) {
  NeuriteBatch batch;
  if (tile.node_count() == 0) return batch;
  const auto soma_at = [&](std::uint32_t node) -> const Soma* {
    if (options.somata == nullptr || options.somata->empty()) return nullptr;
    const auto found = options.somata->find(tile.nodeId(node));
    return found != options.somata->end() ? found->second.get() : nullptr;
  };
  std::vector<float> radii(tile.node_count(), kNoRadius);
  std::vector<bool> soma(tile.node_count(), false);
  for (std::uint32_t s = 0; s < tile.segment_count(); ++s) {
    bool replaced = false;
    const std::uint32_t child = tile.child(s);
    radii[child] = drawnRadius(appearance.radii_um[s], appearance.types[s], &replaced);
    soma[child] = appearance.types[s] == kSomaType;
    if (replaced && tile.owned(s) && soma_at(child) == nullptr) ++batch.implausible_radii;
  }

  GridBox box;
  for (std::uint32_t n = 0; n < tile.node_count(); ++n) box.extend(tile.gridPoint(n));
  Vector3d lo_W = tile.grid().toWorld(box.lo), hi_W = tile.grid().toWorld(box.hi);
  batch.origin_W = (lo_W + hi_W) / 2;
  const auto put = [&](const Vector3d& p_W, float* p_um) {
    const Vector3d p = p_W - batch.origin_W;
    for (int axis = 0; axis < 3; ++axis) p_um[axis] = static_cast<float>(p[axis]);
  };
  const auto colour = [&](std::uint32_t s, std::uint16_t type, const Vector3d& p_W, float radius_um) {
    switch (options.colour) {
      case ColourBy::cell:
        return colourOfNumber(tile.segmentId(s).cell);
      case ColourBy::type:
        return colourOfType(type);
      case ColourBy::depth:
        return colourOnRamp((p_W.y() - options.shallow_um) / (options.deep_um - options.shallow_um));
      // 0.05 to 5 um, the range of neurites, by ratio.
      case ColourBy::radius:
        return colourOnRamp(std::log10(radius_um / 0.05) / 2);
      case ColourBy::tile:
        return colourOfNumber(tile.id());
    }
    return Rgba{};
  };

  batch.segments.reserve(tile.owned_count());
  const auto add = [&](const DrawnSegment& segment) {
    batch.largest_radius_um = std::max({batch.largest_radius_um, segment.a_radius_um, segment.b_radius_um});
    batch.segments.push_back(segment);
  };
  // A soma of segment s.
  const auto add_ball = [&](std::uint32_t s, const Vector3d& centre_W, float radius_um) {
    DrawnSegment ball{};
    put(centre_W, ball.a_um);
    std::copy_n(ball.a_um, 3, ball.b_um);
    ball.a_radius_um = ball.b_radius_um = radius_um;
    ball.colour = colour(s, kSomaType, centre_W, radius_um);
    lo_W = lo_W.cwiseMin(centre_W);
    hi_W = hi_W.cwiseMax(centre_W);
    add(ball);
  };
  std::vector<std::uint32_t> balls;  // parents drawn as such
  std::vector<const Soma*> spheres;  // drawn
  const auto add_sphere = [&](std::uint32_t s, const Soma& sphere) {
    if (std::find(spheres.begin(), spheres.end(), &sphere) != spheres.end()) return;
    bool replaced = false;
    add_ball(s, sphere.centre_um, drawnRadius(static_cast<float>(sphere.radius_um), kSomaType, &replaced));
    if (replaced) ++batch.implausible_radii;
    spheres.push_back(&sphere);
  };
  for (std::uint32_t s = 0; s < tile.segment_count(); ++s) {
    if (!tile.owned(s)) continue;
    if (options.only_cell != UINT32_MAX && tile.segmentId(s).cell != options.only_cell) continue;
    const std::uint32_t child = tile.child(s), parent = tile.parent(s);
    const Soma* const sphere = soma_at(parent);
    if (sphere != nullptr) add_sphere(s, *sphere);
    if (sphere != nullptr && soma_at(child) == sphere) continue;
    DrawnSegment segment{};
    put(tile.position_W(child), segment.a_um);
    put(tile.position_W(parent), segment.b_um);
    segment.a_radius_um = radii[child];
    segment.b_radius_um = radii[parent] != kNoRadius ? radii[parent] : radii[child];
    if (options.roots != nullptr && radii[parent] == kNoRadius && sphere == nullptr) {
      const auto root = options.roots->find(tile.nodeId(parent));
      if (root != options.roots->end()) {
        const float radius_um = drawnRadius(root->second.radius_um, root->second.type);
        if (root->second.type == kSomaType) {
          if (std::find(balls.begin(), balls.end(), parent) == balls.end())
            add_ball(s, tile.position_W(parent), radius_um);
          balls.push_back(parent);
        } else {
          segment.b_radius_um = radius_um;
        }
      }
    }
    // A neurite begins at the soma's middle in many files: it must not widen into a cone as thick as the soma.
    if (soma[parent] && !soma[child]) segment.b_radius_um = segment.a_radius_um;
    segment.colour = colour(s, appearance.types[s], tile.position_W(child), segment.a_radius_um);
    add(segment);
  }
  if (batch.segments.empty()) return batch;
  const Vector3d rim = Vector3d::Constant(batch.largest_radius_um);
  batch.lo_W = lo_W - rim;
  batch.hi_W = hi_W + rim;
  return batch;
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

void sortThickestFirst(NeuriteBatch& batch) {
  std::stable_sort(batch.segments.begin(), batch.segments.end(), isThicker);
}
bool isThickestFirst(const NeuriteBatch& batch) {
  return std::is_sorted(batch.segments.begin(), batch.segments.end(), isThicker);
}

}  // namespace filiform
