// The scenes of the evaluation: one unbranched path with concave elbows, and one branching structure with an easy and a
// hard way through it.
#include "tools/synthetic_neuron.h"
#include "tools/synthetic_path.h"

#include <vector>

namespace filiform::tools {

namespace {

constexpr double kStep_um = 3;
constexpr double kCornerReach_um = 6;  // an elbow is rounded over this length on either side

struct Section {
  int parent;  // section whose end it continues, -1 for the first
  std::vector<Vector3d> corners;
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
  SyntheticPath builder(kStep_um, kCornerReach_um);
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
