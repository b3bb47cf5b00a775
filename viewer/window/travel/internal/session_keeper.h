// Holds the session of the open scene. If its device is lost, replaces it by a session with the mouse at the same
// place, looks for the device every second, and replaces the session again when the device is back. Looks for an
// awaited device in the same way. Devices are opened and closed on other threads. Thread rule: one owner, the window's
// thread.
#pragma once

#include "solver/travel/session/session.h"
#include "solver/travel/session/worker.h"
#include "viewer/window/settings/internal/messages.h"
#include "viewer/window/travel/internal/closing.h"

#include <chrono>
#include <functional>
#include <future>
#include <memory>
#include <string>
#include <vector>

namespace filiform::internal {

class SessionKeeper {
 public:
  // Returns whether `--device NAME` could be opened now. Runs on another thread.
  using PluggedIn = std::function<bool(const std::string&)>;

  struct Lookout {
    PluggedIn plugged_in;  // empty: no device is looked for
    std::string awaited;   // value of --device that replaces the mouse once it is plugged in; empty: none
  };

  // Store and messages must outlive it. `session`: started, with these options. `start`: where a replaced session
  // begins if the proxy had no place.
  SessionKeeper(const TileStore& store, std::unique_ptr<Session> session, SessionOptions options, ProxyPlace start,
                Lookout lookout, Messages& messages);

  Session& current() { return *session_; }
  const Session& current() const { return *session_; }

  enum class Change : std::uint8_t { none, to_mouse, to_device };
  // Once a frame. Replaces the session if necessary. The worker looks for the lost device; its work uses this object.
  Change watch(Worker& worker);
  // Waits until all replaced sessions have ended. Returns their failures, one line each.
  std::vector<std::string> finish() { return closing_.finish(); }

 private:
  void replaceDevice(const std::string& fault);
  void lookForDevice(Worker& worker);
  void takeDeviceBack();
  void replaceSession(SessionOptions options);
  Change finishReplacing();

  const TileStore& store_;
  Messages& messages_;
  SessionOptions options_;
  ProxyPlace start_;
  PluggedIn plugged_in_;
  std::unique_ptr<Session> session_;
  // The next session, while its device is opened.
  std::future<std::unique_ptr<Session>> replacement_;
  SessionOptions replacement_options_;
  Closing closing_;             // of replaced sessions
  std::string missing_device_;  // the value of --device, while the mouse replaces this device; empty: none
  std::chrono::steady_clock::time_point look_again_{}, replace_again_{};
  bool looking_ = false, fault_told_ = false, was_lost_ = false;
};

}  // namespace filiform::internal
