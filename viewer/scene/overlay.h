// The paper's marks in the scene: the workspace's regions as wireframes, and the proxy. Pure functions.
#pragma once

#include "solver/workspace/workspace.h"
#include "viewer/scene/neurite_batches.h"

namespace filiform {

inline constexpr Rgba kDynamicColour{120, 135, 160, 255}, kStaticColour{235, 200, 90, 255},
    kProxyColour{255, 255, 255, 255};

// The edges of the device's box (the dynamic region's outer rim) and of the static region within it, `line_um` thick.
NeuriteBatch workspaceBatch(const Workspace& workspace, double line_um);
// A ball.
NeuriteBatch proxyBatch(const Vector3d& p_W, double radius_um);

}  // namespace filiform
