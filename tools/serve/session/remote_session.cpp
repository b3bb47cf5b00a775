#include "tools/serve/session/remote_session.h"

#include "index/errors.h"
#include "solver/force/force_law.h"
#include "tools/words/answer.h"

#include <algorithm>
#include <cmath>
#include <exception>
#include <utility>

namespace filiform::tools {

namespace {

constexpr double kLeastModelTime_s = 0.0003;  // until the next round, for a LOCAL MODEL to be made now

std::string aboutOf(const SharedScene& scene, const RemoteSessionOptions& options) {
  return jsonText({{"set", scene.served().name()},
                   {"revision", scene.set().revision()},
                   {"hold_s", options.hand.hold_s},
                   {"lo_m", {options.hand.lo_D.x(), options.hand.lo_D.y(), options.hand.lo_D.z()}},
                   {"hi_m", {options.hand.hi_D.x(), options.hand.hi_D.y(), options.hand.hi_D.z()}}});
}

}  // namespace

double RemoteSession::most_force_N() { return ForceLawOptions{}.max_force_N; }

RemoteSession::RemoteSession(std::shared_ptr<SharedScene> scene, const RemoteSessionOptions& options)
    : scene_(std::move(scene)), options_(options) {
  SessionOptions wanted;
  wanted.device = "remote";
  wanted.method = options.method;
  wanted.zoom_um = options.zoom_um;
  wanted.rate_Hz = 1 / RemoteHand::kPeriod_s;
  wanted.stiffness_N_m = options.stiffness_N_m;
  wanted.shared = scene_->tiles(options.ticker);
  wanted.record = options.record;
  wanted.make_device = [this](const std::string&, double) {
    auto device = std::make_unique<RemoteHand>(options_.hand);
    hand_ = device.get();
    return device;
  };
  session_ = std::make_unique<Session>(scene_->set(), wanted);
  stiffness_N_m_ = session_->stiffness_N_m();
  if (!options.record.empty())
    log_ = std::make_unique<SessionLog>(options.record + ".frames", aboutOf(*scene_, options));
}

RemoteSession::~RemoteSession() {
  try {
    follow(std::nullopt);
  } catch (const std::exception&) {  // nothing to release
  }
}

bool RemoteSession::takeProxy(v1::Proxy& proxy) noexcept {
  if (!proxies_.pop(proxy)) return false;
  if (jump_waits_.load(std::memory_order_relaxed))
    proxy.flags = static_cast<std::uint16_t>(proxy.flags | v1::kJumpWaits);
  return true;
}

void RemoteSession::tick(std::uint64_t period) noexcept {
  hand_->beginPeriod(period);
  const NavigationSnapshot& now = session_->tick();
  snapshot_ = &now;
  ticks_.store(now.tick, std::memory_order_relaxed);
  const std::uint32_t proxy_every = proxy_every_.load(std::memory_order_relaxed);
  const std::uint32_t model_every = model_every_.load(std::memory_order_relaxed);
  if (model_every > 0) model_due_ = model_due_ || (period + options_.number) % model_every == 0;
  if (log_ && hand_->isBlocked() != was_blocked_) {
    was_blocked_ = hand_->isBlocked();
    const unsigned char blocked[1] = {was_blocked_};
    log_->note(now.tick, blocked);
  }
  if (log_ && hand_->isFresh()) {
    unsigned char bytes[v1::kHandBytes];
    v1::encode(hand_->used().hand, bytes);
    log_->note(now.tick, bytes);
  }
  if (proxy_every == 0 ? !hand_->isFresh() : period < proxy_at_) return;
  proxy_at_ = (period - proxy_at_ >= proxy_every ? period : proxy_at_) + proxy_every;
  const v1::Proxy proxy = proxyOf(now, *hand_);
  if (log_) {
    unsigned char bytes[v1::kProxyBytes];
    v1::encode(proxy, bytes);
    log_->note(now.tick, bytes);
  }
  proxies_.push(proxy);  // drops the frame if the queue is full: the client does not read
  if (options_.news != nullptr) options_.news->store(true, std::memory_order_release);
}

void RemoteSession::afterAll(double free_s) noexcept {
  session_->prepare(free_s);
  if (!model_due_ || snapshot_ == nullptr || free_s < kLeastModelTime_s) return;
  model_due_ = false;
  maker_.make(*snapshot_, *hand_, session_->graph(), stiffness_N_m_, most_force_N(),
              radius_um_.load(std::memory_order_relaxed), frame_);
  models_.publish(frame_);
  if (options_.news != nullptr) options_.news->store(true, std::memory_order_release);
}

void RemoteSession::jump(const ProxyPlace& place, bool under_hand) {
  const std::lock_guard lock(mutex_);
  session_->jump(place, under_hand);
  jump_waits_ = session_->awaited().has_value();
}

bool RemoteSession::send(const NavigationCommand& command) {
  const std::lock_guard lock(mutex_);
  return session_->send(command);
}

// 0: never.
std::uint32_t RemoteSession::periodsOf(double rate_Hz) {
  if (!(rate_Hz > 0)) return 0;
  return static_cast<std::uint32_t>(std::clamp(std::round(1 / (RemoteHand::kPeriod_s * rate_Hz)), 1.0, 1e6));
}

void RemoteSession::subscribe(const Subscription& subscription) {
  const std::lock_guard lock(mutex_);
  subscription_ = subscription;
  proxy_every_ = periodsOf(subscription.proxy_Hz);
  model_every_ = periodsOf(subscription.model_Hz);
  radius_um_ = subscription.radius_um;
}

Subscription RemoteSession::subscription() const {
  const std::lock_guard lock(mutex_);
  return subscription_;
}

std::size_t RemoteSession::follow(std::optional<std::uint32_t> cell) {
  const std::vector<TileId> tiles = cell ? scene_->served().store().cellTiles(*cell) : std::vector<TileId>{};
  const std::lock_guard lock(mutex_);
  if (hold_) scene_->residency().release(*hold_);
  hold_.reset();
  if (!tiles.empty()) hold_ = scene_->residency().hold(tiles, HoldKind::cell);
  return tiles.size();
}

NavigationSnapshot RemoteSession::now() {
  const std::lock_guard lock(mutex_);
  const NavigationSnapshot& newest = session_->update();
  jump_waits_ = session_->awaited().has_value();
  return newest;
}

std::vector<std::string> RemoteSession::serve(std::vector<std::string>* problems) {
  const std::lock_guard lock(mutex_);
  if (finished_) return {};
  std::vector<std::string> notes;
  session_->update();
  if (log_ && !recording_failed_) {
    try {
      session_->drainRecording();
      log_->drain();
    } catch (const std::exception& failure) {
      recording_failed_ = true;
      notes.push_back("the recording ends; the server's log says why");
      if (problems != nullptr) problems->push_back(std::string("the recording ends: ") + failure.what());
    }
  }
  jump_waits_ = session_->awaited().has_value();
  hand_->block(session_->waitsForFailedTile());
  for (std::string& note : session_->takeNotes())
    notes.push_back(session_->waitsForFailedTile()
                        ? "the proxy waits at a tile that cannot be read: jump elsewhere, or wait"
                        : std::move(note));
  return notes;
}

void RemoteSession::finish() {
  const std::lock_guard lock(mutex_);
  if (finished_) return;
  finished_ = true;
  session_->finish();
  if (log_) log_->finish();
}

}  // namespace filiform::tools
