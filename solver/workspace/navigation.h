// One tick of navigation: from the device's state to the force, through workspace, proxy solver and force law.
//
//   Navigation navigation(graph, makeProxySolver(method, parameters), options);
//   navigation.apply(jump_command, h_D);                        // between ticks
//   const NavigationTick& tick = navigation.tick(state, dt_s);  // tick.wrench goes to the next exchange
//
// Thread rule: haptic thread only; everything but the constructor is noexcept, without allocation, lock or system call.
#pragma once

#include "device/haptic_device.h"
#include "index/streaming/residency.h"
#include "solver/force/force_law.h"
#include "solver/proxy/anchor.h"
#include "solver/proxy/proxy_solver.h"
#include "solver/workspace/navigation_link.h"
#include "solver/workspace/rate_control.h"
#include "solver/workspace/workspace.h"

#include <array>
#include <cstdint>
#include <memory>

namespace filiform {

class GraphView;

enum class ButtonAction : std::uint8_t {
  none,
  toggle_mode,  // to free at once; to constrained by way of the commanding thread
  centre,
  zoom_in,   // by half
  zoom_out,  // by double
  back,      // the commanding thread's history
  forward,
};

enum class AnchorUse : std::uint8_t { by_method, never, always };

struct NavigationOptions {
  ForceLawOptions force;
  WorkspaceOptions workspace;
  // What the spring pulls to: the proxy itself (never; the paper's), or a point that walks to it (always). By method:
  // as the solver wants, that is for bounded climb only.
  AnchorUse anchor_use = AnchorUse::by_method;
  AnchorOptions anchor;
  // For devices that give rates instead of positions; the probe is then made of them, and no force is commanded.
  bool rate_control = false;
  RateControlOptions rate;
  // The workspace drifts no faster than this over the stiffness, so that its drift alone changes the force by at most
  // drift_force_N_s dt.
  double drift_force_N_s = 20;
  // What a press of button i does.
  std::array<ButtonAction, 8> buttons{ButtonAction::toggle_mode, ButtonAction::centre, ButtonAction::zoom_in,
                                      ButtonAction::zoom_out};
};

struct NavigationTick {
  Wrench wrench;                                            // to be commanded now
  Vector3d h_W = Vector3d::Zero();                          // probe, um
  Vector3d p_W = Vector3d::Zero();                          // proxy, um; in free mode the probe
  Vector3d h_D = Vector3d::Zero(), p_D = Vector3d::Zero();  // the same in m, before the workspace drifted
  Vector3d anchor_D = Vector3d::Zero();                     // what the spring pulls to; without an anchor p_D
  NavigationMode mode = NavigationMode::constrained;
  bool solved = false;    // the solver ran: constrained, and the device ready
  bool frontier = false;  // it met a tile that is absent: the proxy rests there, the force goes on as it was
  SolverStep step;        // of the solver; empty unless solved
};

class Navigation {
 public:
  // Constrained, without a place (no force) until the first jump or constrain. The graph must outlive it. Throws
  // UsageError as ForceLaw, Workspace and Anchor do, and for a drift force that is not >= 0 and finite.
  Navigation(const GraphView& graph, std::unique_ptr<ProxySolver> solver, const NavigationOptions& options);

  // Between ticks. `h_D` is where the hand is (m): a jump puts the new place there, so that nothing pulls. At a jump or
  // change of mode the force fades, then grows over the ramp. False, nothing changed but the count, for a command that
  // cannot be: an invalid place, a value that is not finite, a jump while the hand's place is not finite.
  bool apply(const NavigationCommand& command, const Eigen::Vector3d& h_D) noexcept;

  // The answer holds until the next tick. The energy is accounted for by state.sent_N, where the device gives it: the
  // force that was really sent after the tick before. Rotation that the device senses turns the world about the proxy.
  // A state that is not finite or not ready moves nothing and commands no force.
  const NavigationTick& tick(const DeviceState& state, double dt_s) noexcept;

  // After a tick, where there is time before the next one (HapticLoopOptions::idle): decodes what lies around the proxy
  // and towards the hand, so that the next ticks find it decoded. Changes nothing that a tick answers. At most 64
  // nodes, about 6 us; 16 where free_s is below 0.1 ms. Not between a tick and its undoSolve().
  void prepare(double free_s) noexcept;

  // Virtual time: takes the last tick back, bit for bit, so that it can be repeated with more tiles. Once after a tick
  // that met a frontier, before any command and prepare(). After another tick it does nothing.
  void undoSolve() noexcept;

  NavigationMode mode() const noexcept { return state_.mode; }
  const ProxyPlace& place() const noexcept { return solver_->place(); }
  const Workspace& workspace() const noexcept { return state_.workspace; }
  const ForceLaw& force_law() const noexcept { return state_.law; }
  bool anchored() const noexcept { return anchored_; }
  std::uint64_t ticks() const noexcept { return state_.ticks; }

  // What the loader of tiles should know after the last tick.
  ReaderFocus focus() const noexcept;
  // What the eye should know after the last tick.
  void fill(NavigationSnapshot& snapshot) const noexcept;

 private:
  struct State {  // everything a tick changes, but the solver's: saved whole where undoSolve() may follow
    ForceLaw law;
    Workspace workspace;
    Anchor anchor;
    RateControl rate;
    NavigationMode mode = NavigationMode::constrained;
    bool was_ready = false;
    std::uint32_t buttons = 0;
    Vector3d p_W = Vector3d::Zero(), v_W = Vector3d::Zero();  // of the proxy after the last tick, um and um/s
    double time_s = 0;
    std::uint64_t ticks = 0, frontiers = 0, refused = 0;
    std::uint32_t asked_constrain = 0, asked_back = 0, asked_forward = 0;
  };
  bool changesBeforeSolving(const DeviceState& device) const noexcept;
  void pressButtons(std::uint32_t buttons) noexcept;
  void setMode(NavigationMode mode) noexcept;
  void forgetMotion() noexcept;
  void turn(const Eigen::Vector3d& twist_D, double dt_s) noexcept;

  const GraphView& graph_;
  std::unique_ptr<ProxySolver> solver_;
  std::array<ButtonAction, 8> actions_;
  bool anchored_, rate_control_;
  State state_, saved_;
  bool can_undo_ = false;
  NavigationTick tick_;
};

}  // namespace filiform
