// The scenes of the evaluation, built to the text of the paper's section 5 before any method was run on them, two
// scenes with rounded corners, and shapes that are hard to follow.
#include "tools/synthetic/synthetic_neuron.h"
#include "tools/synthetic/synthetic_path.h"

#include <algorithm>
#include <cstdint>
#include <string>
#include <utility>
#include <vector>

#include <Eigen/Geometry>

namespace filiform::tools {

namespace {

constexpr double kStep_um = 3;
constexpr double kRounding_um = 6;  // rounding of the corners of "elbows" and "hooks", on either side of a corner

// Nine straight parts. The route turns by 110 to 130 degrees at every corner, so that a hand that pulls ahead pulls
// back first.
const std::vector<Vector3d>& elbows() {
  static const std::vector<Vector3d> kCorners{{80, 10, 0},    {30, 60, 15},    {110, 75, 30},
                                              {60, 125, 10},  {150, 130, -10}, {95, 185, 5},
                                              {180, 190, 20}, {130, 240, 0},   {220, 250, 0}};
  return kCorners;
}

// Adds branches from `node`, nearly parallel to `ahead`: their directions differ by `spread`, and the wanted branch is
// in the middle. Each is 60 um long. `sides` are multiples of two directions at right angles.
void addNeighbours(SyntheticPath& path, std::uint32_t node, const Vector3d& ahead, double spread,
                   const std::vector<std::pair<double, double>>& sides) {
  const Vector3d side = ahead.cross(Vector3d(0, 0, 1)).normalized(), up = side.cross(ahead);
  for (const auto& [s, u] : sides)
    path.follow(node, {path.at(node) + 60 * (ahead + spread * (s * side + u * up)).normalized()});
}

struct Branching {
  Neuron neuron;
  std::uint32_t easy_tip, hard_tip;
};

// The easy route has two forks with wide angles, and gentle turns. The hard route has a node with five nearly parallel
// branches (.2 rad), a sharp elbow, a node with three branches, and another elbow. The wanted branch is in the middle.
Branching branching() {
  SyntheticPath path(kStep_um);
  const std::uint32_t root = path.root(Vector3d::Zero());
  const std::uint32_t fork = path.follow(root, {{0, 60, 0}});
  const std::uint32_t second = path.follow(fork, {{40, 110, 10}});
  path.follow(second, {{95, 125, 20}, {140, 150, 10}});
  Branching out;
  out.easy_tip = path.follow(second, {{60, 165, 5}, {95, 210, 0}});

  const std::uint32_t five = path.follow(fork, {{-30, 100, -8}});
  const Vector3d ahead = Vector3d(-30, 40, -8).normalized();
  addNeighbours(path, five, ahead, 0.2, {{1, 0}, {0, 1}});
  const Vector3d corner = path.at(five) + 45 * ahead;
  const Vector3d back = Vector3d(-20, -45, 20).normalized();
  const std::uint32_t three = path.follow(five, {corner, corner + 40 * back});
  addNeighbours(path, five, ahead, 0.2, {{-1, 0}, {0, -1}});
  addNeighbours(path, three, back, 0.2, {{1, 0}});
  const Vector3d last = path.at(three) + 40 * back;
  out.hard_tip = path.follow(three, {last, last + Vector3d(-25, 28, -10)});
  addNeighbours(path, three, back, 0.2, {{-1, 0}});
  out.neuron = path.take();
  return out;
}

struct Section {
  int parent;  // the section that it continues; -1 for the first section
  std::vector<Vector3d> corners;
};

constexpr std::size_t kHooksTip = 6;

const std::vector<Section>& hooks() {
  static const std::vector<Section> kSections{
      {-1, {{0, 60, 0}, {8, 110, 4}}},
      {0, {{45, 150, 10}, {70, 200, 0}}},
      {0, {{-30, 140, -8}, {-70, 165, -10}}},
      {1, {{80, 245, -5}, {110, 290, 0}}},
      {1, {{110, 215, 10}, {150, 220, 20}}},
      {2, {{-110, 190, -5}, {-130, 240, 0}}},
      {2, {{-45, 120, -25}, {-85, 95, -15}, {-55, 55, -10}, {-120, 40, 0}}},  // the route's: back, then two hooks
      {5, {{-100, 275, 10}, {-95, 310, 15}}},
      {5, {{-165, 255, -10}, {-190, 290, -20}}},
  };
  return kSections;
}

Neuron buildElbows(double rounding_um, std::uint32_t& tip) {
  SyntheticPath path(kStep_um, rounding_um);
  tip = path.follow(path.root(Vector3d::Zero()), elbows());
  return path.take();
}

Neuron buildHooks(std::uint32_t& tip) {
  SyntheticPath path(kStep_um, kRounding_um);
  const std::uint32_t root = path.root(Vector3d::Zero());
  std::vector<std::uint32_t> ends;
  for (const Section& section : hooks()) {
    const std::uint32_t from = section.parent < 0 ? root : ends[static_cast<std::size_t>(section.parent)];
    ends.push_back(path.follow(from, section.corners));
  }
  tip = ends[kHooksTip];
  return path.take();
}

// 20 000 branches of 100 um at one node, in every direction. The route goes from tip to tip, nearly straight on.
Neuron buildHub(std::uint32_t& tip) {
  SyntheticRandom random(7, 1);
  SyntheticPath path(4);
  const Vector3d first = 100 * random.direction();
  const std::uint32_t hub = path.follow(path.root(first), {Vector3d::Zero()});
  Vector3d last = first;
  std::vector<Vector3d> others;
  for (int i = 1; i < 20000; ++i) {
    others.push_back(100 * random.direction());
    if (others.back().dot(first) < last.dot(first)) std::swap(last, others.back());
  }
  others.erase(std::find(others.begin(), others.end(), first));
  for (const Vector3d& other : others) path.follow(hub, {other});
  tip = path.follow(hub, {last});
  return path.take();
}

// 60 branches of 100 um within .15 rad of a trunk. The route ends in their middle.
Neuron buildBouquet(std::uint32_t& tip) {
  SyntheticRandom random(5, 1);
  SyntheticPath path(2);
  const Vector3d trunk(60, 0, 0);
  const std::uint32_t fork = path.follow(path.root(Vector3d::Zero()), {trunk});
  for (int i = 0; i < 60; ++i) {
    const Vector3d disc = (i == 59 ? 0.05 : 0.15) * random.inDisc();
    tip = path.follow(fork, {trunk + 100 * Vector3d(1, disc.x(), disc.z()).normalized()});
  }
  return path.take();
}

// 60 turns of radius 2 um, .5 um apart.
Neuron buildCoil(std::uint32_t& tip) {
  constexpr double kCosine = 0.96, kSine = 0.28;  // a turn has 22.1 samples
  SyntheticPath path(2);
  Vector3d p(2, 0, 0);
  tip = path.root(p);
  for (int i = 0; i < 1328; ++i) {
    p = {kCosine * p.x() - kSine * p.y(), kSine * p.x() + kCosine * p.y(), p.z() + 0.5 / 22.14};
    tip = path.follow(tip, {p});
  }
  return path.take();
}

// 60 lanes of 6 um, .5 um apart.
Neuron buildMeander(std::uint32_t& tip) {
  SyntheticPath path(1);
  std::vector<Vector3d> corners;
  for (int i = 0; i < 60; ++i) {
    corners.emplace_back(i % 2 == 0 ? 6 : 0, 0.5 * i, 0);
    corners.emplace_back(corners.back() + Vector3d(0, 0.5, 0));
  }
  tip = path.follow(path.root(Vector3d::Zero()), corners);
  return path.take();
}

}  // namespace

Neuron buildScene(const std::string& kind, std::uint32_t& tip) {
  Neuron scene;
  if (kind == "scene1") {
    scene = buildElbows(0, tip);
    scene.description = "scene 1: one path without branches, with sharp concave elbows";
  } else if (kind == "elbows") {
    scene = buildElbows(kRounding_um, tip);
    scene.description = "elbows: scene 1 with rounded corners";
  } else if (kind == "hooks") {
    scene = buildHooks(tip);
    scene.description = "hooks: a branching structure with wide forks and rounded corners, a way with two hooks";
  } else if (kind == "hub") {
    scene = buildHub(tip);
    scene.description = "hub: 20 000 branches at one node, a way from tip to tip";
  } else if (kind == "bouquet") {
    scene = buildBouquet(tip);
    scene.description = "bouquet: 60 branches within .15 rad, a way to one in their middle";
  } else if (kind == "coil") {
    scene = buildCoil(tip);
    scene.description = "coil: 60 turns of radius 2 um, .5 um apart";
  } else if (kind == "meander") {
    scene = buildMeander(tip);
    scene.description = "meander: 60 lanes of 6 um, .5 um apart";
  } else {
    const bool easy = kind == "scene2";
    Branching both = branching();
    tip = easy ? both.easy_tip : both.hard_tip;
    scene = std::move(both.neuron);
    scene.description = easy ? "scene 2: a branching structure, the way with simple forks"
                             : "scene 3: the structure of scene 2, the way with complex branching";
  }
  return scene;
}

}  // namespace filiform::tools
