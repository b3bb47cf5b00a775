// One tick of navigation: from the device's state to the force, through workspace, proxy solver and force law.
//
//   Navigation navigation(graph, makeProxySolver(method, parameters), options);
//   navigation.apply(jump_command, h_D);                        // between ticks
//   const NavigationTick& tick = navigation.tick(state, dt_s);  // tick.wrench goes to the next exchange
//
// Thread rule: haptic thread only. All members except the constructor are noexcept and make no allocation, lock or
// system call.
#pragma once

#include "device/haptic_device.h"
#include "index/streaming/residency.h"
#include "solver/force/force_law.h"
#include "solver/force/spring_model.h"
#include "solver/proxy/anchor.h"
#include "solver/proxy/proxy_solver.h"
#include "solver/workspace/button_map.h"
#include "solver/workspace/navigation_link.h"
#include "solver/workspace/rate_control.h"
#include "solver/workspace/workspace.h"

#include <array>
#include <cstdint>
#include <memory>

namespace filiform {

class GraphView;

// When the spring pulls to an anchor; see NavigationOptions::anchor_use.
enum class AnchorUse : std::uint8_t { by_method, never, always };

// How a hand travels: force, workspace, buttons.
struct NavigationOptions {
  ForceLawOptions force;
  WorkspaceOptions workspace;
  // The point to which the spring pulls: the proxy itself (never; as in the paper), or the anchor, which walks to the
  // proxy (always). by_method: what ProxySolver::wantsAnchor() says, so the anchor for bounded climb only.
  AnchorUse anchor_use = AnchorUse::by_method;
  AnchorOptions anchor;
  // For devices that give rates instead of positions: the probe is computed from the rates, and no force is commanded,
  // but Wrench::resistance: the strain of the leash.
  bool rate_control = false;
  RateControlOptions rate;
  // Computes NavigationTick::wrench.model, for devices that render it (capabilities().renders_model). Forces stay the
  // same.
  bool local_model = false;
  bool has_stylus = false;  // the device senses its orientation: the snapshot shows it
  // How far the proxy may climb along the structure in a tick, for a smaller force: a part of bounded climb's budget,
  // 0 (only where the distance to the hand falls) to 1. The other methods ignore it.
  double leap = 1;
  // Limits the drift of the workspace to this over the stiffness. So drift alone changes the force by at most
  // drift_force_N_s dt in a tick.
  double drift_force_N_s = 20;
  // The action of button i. A change of a button within 20 ms of the last one counts after these 20 ms: a switch
  // bounces.
  ButtonMap buttons{ButtonAction::toggle_mode, ButtonAction::centre, ButtonAction::zoom_in, ButtonAction::zoom_out};
};

// What one tick gives.
struct NavigationTick {
  Wrench wrench;                                            // to be commanded now
  Vector3d h_W = Vector3d::Zero();                          // probe, um
  Vector3d p_W = Vector3d::Zero();                          // proxy, um; in free mode the probe
  Vector3d h_D = Vector3d::Zero(), p_D = Vector3d::Zero();  // h_W and p_W in m, before the workspace drifted
  Vector3d anchor_D = Vector3d::Zero();                     // the point to which the spring pulls; without anchor: p_D
  NavigationMode mode = NavigationMode::constrained;
  bool solved = false;    // the solver ran: constrained mode, device ready
  bool frontier = false;  // the solver met an absent tile: the proxy rests there, the spring still acts
  SolverStep step;        // of the solver; empty unless solved
};

class Navigation {
 public:
  // Starts in constrained mode without a place, so without force, until the first jump or constrain. The graph must
  // outlive the navigation. Throws UsageError as ForceLaw, Workspace and Anchor do, for a drift force that is not >= 0
  // and finite, and for a leap outside 0 to 1.
  Navigation(const GraphView& graph, std::unique_ptr<ProxySolver> solver, const NavigationOptions& options);

  // Applies a command. Call between ticks. `h_D` is the hand's position (m): a jump puts the new place there, so that
  // nothing pulls. At a jump or change of mode the force fades, then grows over the ramp. Returns false for an invalid
  // place, a value that is not finite, or a jump while the hand's position is not finite. The command is then counted
  // as refused, and nothing else changes.
  bool apply(const NavigationCommand& command, const Eigen::Vector3d& h_D) noexcept;

  // One tick. The result is valid until the next tick. If the device gives state.sent_N, the force that was really sent
  // after the last tick, the energy is computed from it. Rotation that the device measures turns the world about the
  // proxy. A state that is not finite or not ready moves nothing and commands no force.
  const NavigationTick& tick(const DeviceState& state, double dt_s) noexcept;

  // Between ticks (HapticLoopOptions::idle): decodes nodes around the proxy and towards the hand, so that the next
  // ticks need not. Changes no result of a tick. At most 64 nodes, about 6 us; 16 nodes if free_s is below 0.1 ms. Do
  // not call between a tick and its undoSolve().
  void prepare(double free_s) noexcept;

  // For virtual time: undoes the last tick, bit for bit, so that it can be repeated with more tiles. Call once after a
  // tick that met a frontier, before any command and before prepare(). Does nothing after other ticks.
  void undoSolve() noexcept;

  NavigationMode mode() const noexcept { return state_.mode; }
  const ProxyPlace& place() const noexcept { return solver_->place(); }
  const Workspace& workspace() const noexcept { return state_.workspace; }
  const ForceLaw& force_law() const noexcept { return state_.law; }
  bool anchored() const noexcept { return anchored_; }
  std::uint64_t ticks() const noexcept { return state_.ticks; }

  // The focus for the loader of tiles, after the last tick.
  ReaderFocus focus() const noexcept;
  // Fills the snapshot for the commanding thread, after the last tick.
  void fill(NavigationSnapshot& snapshot) const noexcept;

 private:
  struct State {  // all that a tick changes, except in the solver; saved before a tick that may be undone
    ForceLaw law;
    Workspace workspace;
    Anchor anchor;
    RateControl rate;
    double leap;
    SpringModel spring{};
    NavigationMode mode = NavigationMode::constrained;
    bool was_ready = false;
    std::uint32_t buttons = 0;  // held, without bounces
    std::array<double, 8> changed_s{-1, -1, -1, -1, -1, -1, -1, -1};
    double clock_s = 0;                                       // the sum of all dt_s
    bool carries = false;                                     // the hand carries the scene along
    Vector3d carried_D = Vector3d::Zero();                    // from the hand to the proxy meanwhile; falls to zero
    Orientation stylus_D{1, 0, 0, 0};                         // the last one that was a rotation
    bool turns = false;                                       // the clutch was held in the last tick
    Vector3d p_W = Vector3d::Zero(), v_W = Vector3d::Zero();  // of the proxy after the last tick, um and um/s
    double time_s = 0;
    std::uint64_t ticks = 0, frontiers = 0, refused = 0;
    std::uint32_t asked_constrain = 0, asked_back = 0, asked_forward = 0;
  };
  bool changesBeforeSolving(const DeviceState& device) const noexcept;
  void watchButtons(std::uint32_t buttons, double dt_s) noexcept;
  void press(ButtonAction action) noexcept;
  // The actions that a held button has now; a click of mode_turn or zoom may still follow in the first kClick_s.
  bool holds(ButtonAction action) const noexcept;
  void carry(const DeviceState& device, bool usable, double dt_s) noexcept;
  void zoomBy(double factor) noexcept;
  void setMode(NavigationMode mode) noexcept;
  void forgetMotion() noexcept;
  void turn(const Eigen::Vector3d& twist_D, double dt_s) noexcept;
  void turnWithStylus(const DeviceState& device) noexcept;
  Vector3d alongSegment_D() const noexcept;

  const GraphView& graph_;
  std::unique_ptr<ProxySolver> solver_;
  ButtonMap actions_;
  bool anchored_, rate_control_, local_model_, has_stylus_;
  std::uint32_t held_actions_ = 0;  // the buttons that act while they are held
  State state_, saved_;
  bool can_undo_ = false;
  NavigationTick tick_;
};

}  // namespace filiform
