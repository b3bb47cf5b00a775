// The scenes of the evaluation: one unbranched path with concave elbows, and one branching structure with an easy and a
// hard way through it.
#include "tools/synthetic_neuron.h"

#include <algorithm>
#include <cmath>
#include <utility>

namespace filiform::tools {

namespace {

constexpr std::uint16_t kNeurite = 3;
constexpr double kStep_um = 3;
constexpr double kCornerReach_um = 6;  // an elbow is rounded over this length on either side

struct Section {
  int parent;  // section whose end it continues, -1 for the first
  std::vector<Vector3d> corners;
};

class SceneBuilder {
 public:
  std::uint32_t root(const Vector3d& p) { return add(p, kNoParent); }

  // Straight runs between the corners, which are rounded by parabolas. Returns the last sample.
  std::uint32_t follow(std::uint32_t from, const std::vector<Vector3d>& corners) {
    for (std::size_t i = 0; i < corners.size(); ++i) {
      if (i + 1 == corners.size()) return run(from, corners[i]);
      const Vector3d& corner = corners[i];
      const Vector3d in = corner + kCornerReach_um * (at(from) - corner).normalized();
      const Vector3d out = corner + kCornerReach_um * (corners[i + 1] - corner).normalized();
      from = run(from, in);
      for (const double t : {0.25, 0.5, 0.75, 1.0})
        from = add((1 - t) * (1 - t) * in + 2 * t * (1 - t) * corner + t * t * out, from);
    }
    return from;
  }

  Neuron take() { return std::move(neuron_); }

 private:
  Vector3d at(std::uint32_t sample) const {
    const auto& p = neuron_.samples[sample].p_nm;
    return Vector3d(static_cast<double>(p[0]), static_cast<double>(p[1]), static_cast<double>(p[2])) / 1000;
  }

  std::uint32_t run(std::uint32_t from, const Vector3d& to) {
    const Vector3d start = at(from);
    const int steps = std::max(1, static_cast<int>(std::lround((to - start).norm() / kStep_um)));
    for (int i = 1; i <= steps; ++i) from = add(start + (to - start) * (static_cast<double>(i) / steps), from);
    return from;
  }

  std::uint32_t add(const Vector3d& p, std::uint32_t parent) {
    NeuronSample sample{};
    for (int i = 0; i < 3; ++i) sample.p_nm[static_cast<std::size_t>(i)] = std::llround(p[i] * 1000);
    sample.radius_nm = 1000;
    sample.parent = parent;
    sample.type = kNeurite;
    neuron_.samples.push_back(sample);
    return static_cast<std::uint32_t>(neuron_.samples.size() - 1);
  }

  Neuron neuron_;
};

// Nine legs; the way turns by 110 to 130 degrees at every corner, so that a hand which pulls ahead pulls back first.
const std::vector<Vector3d>& elbows() {
  static const std::vector<Vector3d> kCorners{{80, 10, 0},    {30, 60, 15},    {110, 75, 30},
                                              {60, 125, 10},  {150, 130, -10}, {95, 185, 5},
                                              {180, 190, 20}, {130, 240, 0},   {220, 250, 0}};
  return kCorners;
}

constexpr std::size_t kEasyTip = 3, kHardTip = 6;

const std::vector<Section>& branches() {
  static const std::vector<Section> kSections{
      {-1, {{0, 60, 0}, {8, 110, 4}}},
      {0, {{45, 150, 10}, {70, 200, 0}}},
      {0, {{-30, 140, -8}, {-70, 165, -10}}},
      {1, {{80, 245, -5}, {110, 290, 0}}},  // the easy tip: every turn is gentle
      {1, {{110, 215, 10}, {150, 220, 20}}},
      {2, {{-110, 190, -5}, {-130, 240, 0}}},
      {2, {{-45, 120, -25}, {-85, 95, -15}, {-55, 55, -10}, {-120, 40, 0}}},  // the hard tip: back, then two hooks
      {5, {{-100, 275, 10}, {-95, 310, 15}}},
      {5, {{-165, 255, -10}, {-190, 290, -20}}},
  };
  return kSections;
}

}  // namespace

Neuron buildScene(const std::string& kind, std::uint32_t& tip) {
  SceneBuilder builder;
  const std::uint32_t root = builder.root(Vector3d::Zero());
  Neuron scene;
  if (kind == "scene1") {
    tip = builder.follow(root, elbows());
    scene = builder.take();
    scene.description = "scene 1: one path without branches, with concave elbows";
    return scene;
  }
  std::vector<std::uint32_t> ends;
  for (const Section& section : branches()) {
    const std::uint32_t from = section.parent < 0 ? root : ends[static_cast<std::size_t>(section.parent)];
    ends.push_back(builder.follow(from, section.corners));
  }
  const bool easy = kind == "scene2";
  tip = ends[easy ? kEasyTip : kHardTip];
  scene = builder.take();
  scene.description =
      easy ? "scene 2: a branching structure, the easy way" : "scene 3: the structure of scene 2, the hard way";
  return scene;
}

}  // namespace filiform::tools
