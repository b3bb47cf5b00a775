// The channels between the haptic thread and the one thread that commands it (viewer, command line). Commands go
// through a bounded ring, snapshots come back through a triple buffer. Neither thread ever waits for the other.
//
// The commanding thread does all work that needs the disk or a search (nearest segment, cell names, history), and then
// sends the place that it found.
#pragma once

#include "device/haptic_device.h"
#include "index/spsc_ring.h"
#include "index/triple_buffer.h"
#include "solver/proxy/proxy_solver.h"

#include <cstdint>
#include <optional>

#include <Eigen/Core>
#include <Eigen/Geometry>

namespace filiform {

enum class NavigationMode : std::uint8_t {
  constrained,  // the proxy travels on the neurites and pulls the hand
  free,         // the probe moves freely, without force
};
const char* toString(NavigationMode mode);

struct NavigationCommand {
  enum class Kind : std::uint8_t {
    none,
    jump,       // constrained mode at `place`; the world moves so that `place` is under the hand
    constrain,  // constrained mode at `place`; the world does not move; the force draws the hand there over the ramp
    free,       // free mode
    zoom,       // multiply the zoom by `factor`, about the proxy
    rotate,     // turn the world by `about_x_rad`, `about_y_rad` about the screen's axes through the proxy
    centre,     // bring the proxy to the centre of the device, at the drift speed
    leap,       // from now on, the solver may leap by `factor`: NavigationOptions::leap
  };
  Kind kind = Kind::none;
  ProxyPlace place;
  std::optional<CellReach> reach;  // jump, constrain: of the place's cell; none: unchanged
  double factor = 1;
  double about_x_rad = 0, about_y_rad = 0;
};

struct NavigationSnapshot {  // of one tick
  std::uint64_t tick = 0;    // number of the tick, from 1; 0: none yet
  double time_s = 0;         // of the device's state
  NavigationMode mode = NavigationMode::constrained;
  ProxyPlace place;                 // constrained only
  Vector3d p_W = Vector3d::Zero();  // proxy; in free mode the probe
  Vector3d h_W = Vector3d::Zero();  // probe
  Vector3d p_D = Vector3d::Zero(), h_D = Vector3d::Zero();
  Vector3d anchor_D = Vector3d::Zero();  // the point to which the spring pulls; without anchor: p_D
  Vector3d force_N = Vector3d::Zero();   // frame D
  Vector3d centre_W = Vector3d::Zero();  // of the workspace
  Eigen::Quaterniond rotation_WD = Eigen::Quaterniond::Identity();
  double zoom_um = 0, leap = 1;
  bool has_stylus = false;  // the device senses its orientation
  Orientation stylus_D{1, 0, 0, 0};
  std::uint32_t visited = 0;
  bool frontier = false, capped = false;
  std::uint64_t frontiers = 0, commands_refused = 0;  // in total so far
  // Number of button presses that the commanding thread must carry out. It acts when a count has risen.
  std::uint32_t asked_constrain = 0, asked_back = 0, asked_forward = 0;
};

struct NavigationLink {
  SpscRing<NavigationCommand> commands{256};   // commanding thread -> haptic thread; if full, retry after a tick
  TripleBuffer<NavigationSnapshot> snapshots;  // haptic thread -> commanding thread
};

}  // namespace filiform
