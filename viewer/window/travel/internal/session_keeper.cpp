#include "viewer/window/travel/internal/session_keeper.h"

#include "index/errors.h"
#include "viewer/window/travel/internal/started_session.h"

#include <exception>
#include <utility>

namespace filiform::internal {

namespace {

constexpr std::chrono::seconds kLookEvery{1};  // between two attempts to replace or to find a device

}  // namespace

SessionKeeper::SessionKeeper(const TileStore& store, std::unique_ptr<Session> session, SessionOptions options,
                             ProxyPlace start, Lookout lookout, Messages& messages)
    : store_(store),
      messages_(messages),
      options_(std::move(options)),
      start_(std::move(start)),
      plugged_in_(std::move(lookout.plugged_in)),
      session_(std::move(session)) {
  if (options_.device == "mouse") missing_device_ = std::move(lookout.awaited);
}

SessionKeeper::Change SessionKeeper::watch(Worker& worker) {
  const std::string fault = session_->fault();
  if (!fault.empty()) replaceDevice(fault);
  lookForDevice(worker);
  return finishReplacing();
}

// Begins to replace the session of a lost device by one with the mouse. If that fails, a later call tries again.
void SessionKeeper::replaceDevice(const std::string& fault) {
  if (!std::exchange(fault_told_, true)) messages_.say(fault);
  const auto now = std::chrono::steady_clock::now();
  if (options_.device == "mouse" || session_->replaying() || replacement_.valid() || now < replace_again_) return;
  replace_again_ = now + kLookEvery;
  SessionOptions options = options_;
  missing_device_ = std::exchange(options.device, "mouse");
  options.stiffness_N_m.reset();  // this was the lost device's
  options.record.clear();
  replaceSession(std::move(options));
}

void SessionKeeper::replaceSession(SessionOptions options) {
  options.zoom_um = session_->now().zoom_um;
  replacement_options_ = options;
  replacement_ = startSession(store_, std::move(options));
}

SessionKeeper::Change SessionKeeper::finishReplacing() {
  for (const std::string& failure : closing_.takeFailures()) messages_.say(failure);
  if (!replacement_.valid() || replacement_.wait_for(std::chrono::seconds(0)) != std::future_status::ready)
    return Change::none;
  std::unique_ptr<Session> session;
  try {
    session = replacement_.get();
  } catch (const std::exception& error) {  // keep the old session until a later attempt
    messages_.sayOnce(error.what());
    return Change::none;
  }
  const NavigationSnapshot last = session_->now();
  closing_.begin([old = std::shared_ptr<Session>(std::move(session_))] { old->finish(); });
  session_ = std::move(session);
  options_ = replacement_options_;
  if (last.zoom_um != options_.zoom_um) {
    NavigationCommand command;
    command.kind = NavigationCommand::Kind::zoom;
    command.factor = last.zoom_um / options_.zoom_um;
    session_->send(command);
  }
  if (last.leap != options_.leap) {
    NavigationCommand command;
    command.kind = NavigationCommand::Kind::leap;
    command.factor = last.leap;
    session_->send(command);
  }
  session_->jump(last.place.valid() ? last.place : start_);
  fault_told_ = false;
  replace_again_ = {};
  if (options_.device == "mouse") {
    was_lost_ = true;
    messages_.say("the device is lost; the mouse replaces it");
    return Change::to_mouse;
  }
  missing_device_.clear();
  messages_.say(session_->deviceName() + (was_lost_ ? " is connected again" : " is connected"));
  return Change::to_device;
}

void SessionKeeper::lookForDevice(Worker& worker) {
  const auto now = std::chrono::steady_clock::now();
  if (missing_device_.empty() || !plugged_in_ || looking_ || replacement_.valid() || now < look_again_) return;
  looking_ = true;
  look_again_ = now + kLookEvery;
  worker.ask([this, plugged_in = plugged_in_, device = missing_device_]() -> Worker::Done {
    bool is_back = false;
    try {
      is_back = plugged_in(device);
    } catch (const Error&) {  // look again later
    }
    return [this, is_back] {
      looking_ = false;
      if (is_back) takeDeviceBack();
    };
  });
}

void SessionKeeper::takeDeviceBack() {
  if (replacement_.valid()) return;
  SessionOptions options = options_;
  options.device = missing_device_;
  replaceSession(std::move(options));
}

}  // namespace filiform::internal
