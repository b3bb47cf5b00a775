// Overlays: the workspace's two regions as wireframes, and the proxy. Pure functions.
#pragma once

#include "solver/workspace/workspace.h"
#include "viewer/scene/neurite_batches.h"

namespace filiform {

inline constexpr Rgba kDynamicColour{120, 135, 160, 255}, kStaticColour{235, 200, 90, 255},
    kProxyColour{255, 255, 255, 255};

// The edges of the device's box (the outer rim of the dynamic region) and of the static region inside, `line_um` thick.
NeuriteBatch workspaceBatch(const Workspace& workspace, double line_um);
// A sphere.
NeuriteBatch proxyBatch(const Vector3d& p_W, double radius_um);

}  // namespace filiform
