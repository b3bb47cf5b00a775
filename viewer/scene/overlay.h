// Overlays: the workspace's two regions as wireframes, the proxy, and the stylus in the hand. Pure functions.
#pragma once

#include "solver/workspace/workspace.h"
#include "viewer/scene/neurite_batches.h"

#include <span>

namespace filiform {

inline constexpr Rgba kDynamicColour{120, 135, 160, 255}, kStaticColour{235, 200, 90, 255},
    kProxyColour{255, 255, 255, 255}, kProxyOnLightColour{40, 44, 52, 255}, kCompanionColour{215, 140, 255, 255},
    kStylusColour{190, 200, 215, 255}, kMarkColour{255, 70, 190, 255};

// The edges of the device's box (the outer rim of the dynamic region) and of the static region inside, `line_um` thick.
NeuriteBatch workspaceBatch(const Workspace& workspace, double line_um);

struct Stylus {
  Vector3d tip_W = Vector3d::Zero();                                // where the hand is, um
  Eigen::Quaterniond rotation_WS = Eigen::Quaterniond::Identity();  // its shaft points along z, its buttons along y
};
// A shaft that widens from the tip, and a short bar on the side of its buttons, which shows its roll.
NeuriteBatch stylusBatch(const Stylus& stylus, double length_um);

// Spheres. Requires at least one.
NeuriteBatch ballsBatch(std::span<const Vector3d> places_W, double radius_um, const Rgba& colour);
// A sphere.
NeuriteBatch proxyBatch(const Vector3d& p_W, double radius_um, const Rgba& colour = kProxyColour);

}  // namespace filiform
