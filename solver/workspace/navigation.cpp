#include "solver/workspace/navigation.h"

#include "index/errors.h"
#include "solver/graph/graph_view.h"

#include <algorithm>
#include <cmath>

namespace filiform {
namespace {

constexpr double kVelocityTime_s = 0.1;  // low-pass filter of the proxy's velocity, for the loader and prepare() only
constexpr double kAhead_s = 0.02;        // prepare() looks this far ahead
constexpr double kMostTurn_rad = 0.5;    // of a stylus in a tick
constexpr double kBounce_s = 0.02;       // a button that changes again within this time bounces
constexpr double kClick_s = 0.3;         // a button that is released sooner was clicked
constexpr double kZoomOut_s = 0.5;       // for twice the zoom, of a button that is held
constexpr double kZoomRoll_rad = 0.8;    // of a stylus, for twice the zoom
constexpr double kCarried_s = 0.05;      // the distance between a carried scene's proxy and the hand falls to 1/e
constexpr double kFree_s = 1e-4;         // with less time left, prepare() decodes kLeastPrepared nodes
constexpr std::uint32_t kPrepared = 64, kLeastPrepared = 16;  // nodes

WorkspaceOptions gentle(const NavigationOptions& options) {
  if (!(options.drift_force_N_s >= 0 && std::isfinite(options.drift_force_N_s)))
    throw UsageError("the drift force of the workspace must be finite and >= 0 N/s");
  if (!(options.leap >= 0 && options.leap <= 1)) throw UsageError("the leap must be between 0 and 1");
  WorkspaceOptions workspace = options.workspace;
  workspace.drift_speed_m_s =
      std::min(workspace.drift_speed_m_s, options.drift_force_N_s / options.force.stiffness_N_m);
  return workspace;
}

bool isReach(const CellReach& reach) noexcept {
  return reach.r_min_um >= 0 && std::isfinite(reach.r_min_um) && reach.r_max_um >= 0 && std::isfinite(reach.r_max_um);
}

}  // namespace

Navigation::Navigation(const GraphView& graph, std::unique_ptr<ProxySolver> solver, const NavigationOptions& options)
    : graph_(graph),
      solver_(std::move(solver)),
      actions_(options.buttons),
      anchored_(options.anchor_use == AnchorUse::always ||
                (options.anchor_use == AnchorUse::by_method && solver_->wantsAnchor())),
      rate_control_(options.rate_control),
      local_model_(options.local_model),
      has_stylus_(options.has_stylus),
      state_{ForceLaw(options.force), Workspace(gentle(options)), Anchor(options.anchor), RateControl(options.rate),
             options.leap},
      saved_(state_) {
  for (std::size_t i = 0; i < actions_.size(); ++i)
    if (actions_[i] >= ButtonAction::turn) held_actions_ |= 1U << i;
}

void Navigation::setMode(NavigationMode mode) noexcept {
  state_.mode = mode;
  state_.law.restart();
  forgetMotion();
}

void Navigation::forgetMotion() noexcept {
  state_.anchor.reset();
  state_.rate.reset();
}

void Navigation::turn(const Vector3d& twist_D, double dt_s) noexcept {
  const Vector3d angle = twist_D * dt_s;
  if (!angle.allFinite() || angle.isZero(0)) return;
  Workspace& workspace = state_.workspace;
  if (angle.x() != 0 || angle.y() != 0) workspace.rotate(angle.x(), angle.y(), state_.p_W);
  if (rate_control_ && angle.z() != 0)
    workspace.setZoom(workspace.zoom_um() * state_.rate.zoomFactor(twist_D.z(), dt_s), state_.p_W);
}

void Navigation::turnWithStylus(const DeviceState& device) noexcept {
  const bool is_rotation = std::abs(device.orientation_D.norm() - 1) < 1e-3;
  const bool rolls = holds(ButtonAction::mode_turn);
  const bool held = is_rotation && (rolls || holds(ButtonAction::turn) || holds(ButtonAction::turn_moving));
  if (held && state_.turns) {
    const Orientation step = device.orientation_D * state_.stylus_D.conjugate();
    const double sine = step.vec().norm(), angle_rad = 2 * std::atan2(sine, std::abs(step.w()));
    // A turn about z does not turn the scene, as in the paper. A greater turn is an error of the sensor.
    if (sine > 0 && angle_rad < kMostTurn_rad) {
      const Vector3d turn = (step.w() < 0 ? -angle_rad : angle_rad) / sine * step.vec();
      if (turn.x() != 0 || turn.y() != 0) state_.workspace.rotate(turn.x(), turn.y(), state_.p_W);
      if (rolls) zoomBy(std::exp2(turn.z() / kZoomRoll_rad));
    }
  }
  state_.turns = held;
  if (is_rotation) state_.stylus_D = device.orientation_D;
}

// The direction in which the proxy slides; zero at a node.
Vector3d Navigation::alongSegment_D() const noexcept {
  if (place().at_node) return Vector3d::Zero();
  const GraphView::SegmentRef at = graph_.segment(place().tile, place().segment);
  if (!at) return Vector3d::Zero();
  const Vector3d along_W =
      at.tile->position_W(at.tile->parent(at.segment)) - at.tile->position_W(at.tile->child(at.segment));
  const double length_um = along_W.norm();
  if (!(length_um > 0)) return Vector3d::Zero();
  return state_.workspace.rotationMatrix().transpose() * (along_W / length_um);
}

bool Navigation::apply(const NavigationCommand& command, const Eigen::Vector3d& h_D) noexcept {
  using Kind = NavigationCommand::Kind;
  bool done = true;
  switch (command.kind) {
    case Kind::none:
      break;
    case Kind::jump:
    case Kind::constrain:
      done = command.place.valid() && command.place.p_W.allFinite() &&
             (command.kind != Kind::jump || h_D.allFinite()) && (!command.reach || isReach(*command.reach));
      if (!done) break;
      if (command.reach) solver_->setReach(*command.reach);
      if (command.kind == Kind::jump) state_.workspace.place(command.place.p_W, h_D);
      solver_->setPlace(command.place);
      state_.p_W = command.place.p_W;
      state_.v_W.setZero();
      setMode(NavigationMode::constrained);
      break;
    case Kind::free:
      setMode(NavigationMode::free);
      break;
    case Kind::zoom:
      done = std::isfinite(command.factor) && command.factor > 0;
      if (done) state_.workspace.setZoom(state_.workspace.zoom_um() * command.factor, state_.p_W);
      break;
    case Kind::rotate:
      done = std::isfinite(command.about_x_rad) && std::isfinite(command.about_y_rad);
      if (done) state_.workspace.rotate(command.about_x_rad, command.about_y_rad, state_.p_W);
      break;
    case Kind::centre:
      state_.workspace.startCentring();
      break;
    case Kind::leap:
      done = command.factor >= 0 && command.factor <= 1;
      if (done) state_.leap = command.factor;
      break;
  }
  state_.refused += !done;
  return done;
}

void Navigation::zoomBy(double factor) noexcept {
  state_.workspace.setZoom(factor * state_.workspace.zoom_um(), state_.p_W);
}

bool Navigation::holds(ButtonAction action) const noexcept {
  const bool clicks = action == ButtonAction::zoom || action == ButtonAction::mode_turn;
  for (std::size_t i = 0; i < actions_.size(); ++i)
    if (actions_[i] == action && (state_.buttons >> i & 1U) != 0 &&
        (!clicks || state_.clock_s - state_.changed_s[i] >= kClick_s))
      return true;
  return false;
}

void Navigation::watchButtons(std::uint32_t buttons, double dt_s) noexcept {
  if (dt_s > 0 && std::isfinite(dt_s)) state_.clock_s += dt_s;
  for (std::size_t i = 0; i < actions_.size(); ++i) {
    const std::uint32_t bit = 1U << i;
    const double since_s = state_.clock_s - state_.changed_s[i];
    if (((buttons ^ state_.buttons) & bit) == 0 || since_s < kBounce_s) continue;
    state_.buttons ^= bit;
    state_.changed_s[i] = state_.clock_s;
    const bool is_click = (buttons & bit) == 0 && since_s < kClick_s;
    if (actions_[i] == ButtonAction::zoom && is_click) press(ButtonAction::zoom_in);
    if (actions_[i] == ButtonAction::mode_turn && is_click) press(ButtonAction::toggle_mode);
    if ((buttons & bit) != 0) press(actions_[i]);
  }
  if (dt_s > 0 && holds(ButtonAction::zoom)) zoomBy(std::exp2(dt_s / kZoomOut_s));
}

void Navigation::press(ButtonAction action) noexcept {
  switch (action) {
    case ButtonAction::toggle_mode:
      if (state_.mode == NavigationMode::free)
        ++state_.asked_constrain;
      else
        setMode(NavigationMode::free);
      break;
    case ButtonAction::centre:
      state_.workspace.startCentring();
      break;
    case ButtonAction::zoom_in:
      zoomBy(0.5);
      break;
    case ButtonAction::zoom_out:
      zoomBy(2);
      break;
    case ButtonAction::back:
      ++state_.asked_back;
      break;
    case ButtonAction::forward:
      ++state_.asked_forward;
      break;
    default:  // acts while it is held
      break;
  }
}

// While the scene is carried, the force fades and stays zero; then it grows over the ramp. So a carried scene gives no
// energy, and the proxy that lies at the hand afterwards pulls nothing.
void Navigation::carry(const DeviceState& device, bool usable, double dt_s) noexcept {
  const bool carries = usable && !rate_control_ &&
                       (holds(ButtonAction::carry) || holds(ButtonAction::turn) || holds(ButtonAction::mode_turn));
  if (carries != state_.carries) {
    state_.law.restart();
    forgetMotion();
    state_.carried_D = state_.workspace.toDevice(state_.p_W) - device.p_D;
  }
  state_.carries = carries;
  if (!carries) return;
  if (dt_s > 0) state_.carried_D *= 1 - std::min(1.0, dt_s / kCarried_s);
  state_.workspace.place(state_.p_W, device.p_D + state_.carried_D);
}

bool Navigation::changesBeforeSolving(const DeviceState& device) const noexcept {
  const bool ready = device.status == DeviceStatus::ready;
  return ready != state_.was_ready || state_.carries ||
         (ready && (rate_control_ || (device.buttons & 0xff) != state_.buttons ||
                    (device.buttons & held_actions_) != 0 || !device.twist_D.isZero(0)));
}

[[gnu::flatten]] const NavigationTick& Navigation::tick(const DeviceState& device, double dt_s) noexcept {
  const bool changes_before = changesBeforeSolving(device);
  const double clock_s = state_.clock_s;
  if (changes_before) saved_ = state_;
  tick_.wrench = Wrench{};
  tick_.solved = tick_.frontier = false;
  tick_.step.clear();

  const bool ready = device.status == DeviceStatus::ready;
  if (ready && !state_.was_ready) {
    state_.law.restartFromZero();
    forgetMotion();
  }
  state_.was_ready = ready;
  if (ready) watchButtons(device.buttons, dt_s);
  if (ready) turn(device.twist_D, dt_s);
  if (ready) turnWithStylus(device);
  carry(device, ready && device.p_D.allFinite(), dt_s);

  Workspace& workspace = state_.workspace;
  tick_.mode = state_.mode;
  tick_.h_D = rate_control_ && ready ? state_.rate.probe(workspace.toDevice(state_.p_W), device.v_D, dt_s) : device.p_D;
  const bool usable = ready && tick_.h_D.allFinite();
  tick_.h_W = workspace.toWorld(tick_.h_D);
  Vector3d p_W = state_.p_W;
  if (state_.carries) {
    // The proxy keeps its place.
  } else if (state_.mode == NavigationMode::constrained) {
    if (usable && place().valid()) {
      tick_.solved = true;
      solver_->advance(graph_, {tick_.h_W, dt_s, workspace.scale_um_m(), state_.leap}, tick_.step);
      tick_.frontier = tick_.step.absent.count > 0;
      p_W = place().p_W;
    }
  } else if (usable && tick_.h_W.allFinite()) {
    p_W = tick_.h_W;
  }
  can_undo_ = tick_.frontier;
  if (can_undo_ && !changes_before) {
    saved_ = state_;
    saved_.clock_s = clock_s;
  }

  ++state_.ticks;
  state_.time_s = device.time_s;
  state_.frontiers += tick_.frontier;
  if (device.sent_N) state_.law.acted(*device.sent_N);
  tick_.p_W = p_W;
  tick_.p_D = workspace.toDevice(p_W);
  if (rate_control_) state_.rate.moveProxy(tick_.p_D);
  tick_.anchor_D = tick_.p_D;
  if (anchored_ && state_.mode == NavigationMode::constrained) {
    if (tick_.solved && tick_.h_W.allFinite()) {
      const Vector3d last_p_D = p_W == state_.p_W ? tick_.p_D : workspace.toDevice(state_.p_W);
      state_.anchor.advance(tick_.p_D - last_p_D, tick_.h_D, dt_s);
    }
    tick_.anchor_D += state_.anchor.offset_D();
  }

  // Positions that are not finite are passed on, so that the force law counts them.
  const bool feels = ready && !rate_control_;
  const bool pulls = feels && state_.mode == NavigationMode::constrained && place().valid() && !state_.carries;
  tick_.wrench.force_N = pulls   ? state_.law.apply(tick_.anchor_D, device.p_D, device.v_D, dt_s)
                         : feels ? state_.law.applyNothing(device.p_D, dt_s)
                                 : state_.law.release();
  if (rate_control_ && ready && tick_.solved) tick_.wrench.resistance = std::min(1.0, state_.rate.strain());
  if (local_model_ && pulls && usable && !state_.law.fading())
    tick_.wrench.model = state_.spring.about(device.p_D, tick_.anchor_D - device.p_D, tick_.wrench.force_N,
                                             state_.law.options().stiffness_N_m, alongSegment_D());
  else
    state_.spring.reset();

  if (dt_s > 0 && std::isfinite(dt_s)) {
    const Vector3d v_W = (p_W - state_.p_W) / dt_s;
    if (v_W.allFinite()) state_.v_W += std::min(1.0, dt_s / kVelocityTime_s) * (v_W - state_.v_W);
    if (usable && !state_.carries) state_.law.carried(workspace.drift(p_W, tick_.p_D, dt_s));
  }
  state_.p_W = p_W;
  return tick_;
}

void Navigation::prepare(double free_s) noexcept {
  if (state_.mode != NavigationMode::constrained || !place().valid()) return;
  const Vector3d ahead_W = (tick_.solved ? tick_.h_W : state_.p_W) + kAhead_s * state_.v_W;
  if (ahead_W.allFinite()) solver_->prepare(graph_, ahead_W, free_s >= kFree_s ? kPrepared : kLeastPrepared);
}

void Navigation::undoSolve() noexcept {
  if (!can_undo_) return;
  solver_->undo();
  state_ = saved_;
  can_undo_ = tick_.solved = false;
}

ReaderFocus Navigation::focus() const noexcept {
  ReaderFocus focus;
  focus.p_W = state_.p_W;
  focus.v_W = state_.v_W;
  const WorkspaceOptions& box = state_.workspace.options();
  focus.radius_um = 0.5 * (box.hi_D - box.lo_D).maxCoeff() * state_.workspace.scale_um_m();
  if (state_.mode == NavigationMode::constrained && place().valid()) {
    focus.active_tile = place().tile;
    focus.active_node = place().at_node ? place().node : NodeId{place().segment.cell, place().segment.segment};
    if (tick_.h_W.allFinite()) focus.pull_W = tick_.h_W - state_.p_W;
  }
  return focus;
}

void Navigation::fill(NavigationSnapshot& snapshot) const noexcept {
  snapshot.tick = state_.ticks;
  snapshot.time_s = state_.time_s;
  snapshot.mode = state_.mode;
  snapshot.place = place();
  snapshot.p_W = tick_.p_W;
  snapshot.h_W = tick_.h_W;
  snapshot.p_D = tick_.p_D;
  snapshot.h_D = tick_.h_D;
  snapshot.anchor_D = tick_.anchor_D;
  snapshot.force_N = tick_.wrench.force_N;
  snapshot.centre_W = state_.workspace.centre_W();
  snapshot.rotation_WD = Eigen::Quaterniond(state_.workspace.rotationMatrix());
  snapshot.zoom_um = state_.workspace.zoom_um();
  snapshot.leap = state_.leap;
  snapshot.has_stylus = has_stylus_;
  snapshot.stylus_D = state_.stylus_D;
  snapshot.visited = tick_.step.visited;
  snapshot.frontier = tick_.frontier;
  snapshot.capped = tick_.step.capped;
  snapshot.frontiers = state_.frontiers;
  snapshot.commands_refused = state_.refused;
  snapshot.asked_constrain = state_.asked_constrain;
  snapshot.asked_back = state_.asked_back;
  snapshot.asked_forward = state_.asked_forward;
}

}  // namespace filiform
