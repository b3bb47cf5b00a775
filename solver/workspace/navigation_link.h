// What crosses between the haptic thread and the one thread that commands it (viewer, command line): commands one way,
// through a bounded ring, snapshots the other, through a triple buffer. Neither side ever waits for the other.
//
// Whatever needs the disk or a search (the nearest segment, a cell's name, history) is resolved by the commanding
// thread, which then sends the place that it found.
#pragma once

#include "index/spsc_ring.h"
#include "index/triple_buffer.h"
#include "solver/proxy/proxy_solver.h"

#include <cstdint>

#include <Eigen/Core>
#include <Eigen/Geometry>

namespace filiform {

enum class NavigationMode : std::uint8_t {
  constrained,  // the proxy travels on the structure and pulls the hand
  free,         // the probe moves freely, without force
};
const char* toString(NavigationMode mode);

struct NavigationCommand {
  enum class Kind : std::uint8_t {
    none,
    jump,       // constrained at `place`, which comes under the hand
    constrain,  // constrained at `place`, the workspace as it lies: the hand is drawn there over the start ramp
    free,       // free mode
    zoom,       // multiplies the zoom by `factor`, about the proxy
    rotate,     // turns the world by `about_x_rad`, `about_y_rad` about the screen's axes through the proxy
    centre,     // brings the proxy to the centre of the device, at the drift speed
  };
  Kind kind = Kind::none;
  ProxyPlace place;
  double factor = 1;
  double about_x_rad = 0, about_y_rad = 0;
};

struct NavigationSnapshot {  // of one tick
  std::uint64_t tick = 0;    // counted from 1; 0: none yet
  double time_s = 0;         // of the device's state
  NavigationMode mode = NavigationMode::constrained;
  ProxyPlace place;                 // constrained only
  Vector3d p_W = Vector3d::Zero();  // proxy; in free mode the probe
  Vector3d h_W = Vector3d::Zero();  // probe
  Vector3d p_D = Vector3d::Zero(), h_D = Vector3d::Zero();
  Vector3d anchor_D = Vector3d::Zero();  // what the spring pulls to; but for bounded climb p_D
  Vector3d force_N = Vector3d::Zero();   // frame D
  Vector3d centre_W = Vector3d::Zero();  // of the workspace
  Eigen::Quaterniond rotation_WD = Eigen::Quaterniond::Identity();
  double zoom_um = 0;
  std::uint32_t visited = 0;
  bool frontier = false, capped = false;
  std::uint64_t frontiers = 0, commands_refused = 0;  // so far
  // How often a button of the device asked for what the commanding thread must resolve: it acts when a count has risen.
  std::uint32_t asked_constrain = 0, asked_back = 0, asked_forward = 0;
};

struct NavigationLink {
  SpscRing<NavigationCommand> commands{256};   // commanding thread -> haptic thread; full: try again after a tick
  TripleBuffer<NavigationSnapshot> snapshots;  // haptic thread -> commanding thread
};

}  // namespace filiform
