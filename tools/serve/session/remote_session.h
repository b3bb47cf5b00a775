// RemoteSession: the travel of one client. The ticking thread runs the proxy with the client's newest hand; the client
// gets PROXY and LOCAL MODEL frames.
//
// Thread rule: receive(), takeProxy() and takeModel() belong to one thread, that of the connection. tick()
// and afterAll() belong to the ticker. All other members are internally synchronised.
#pragma once

#include "index/spsc_ring.h"
#include "index/triple_buffer.h"
#include "solver/travel/session/session.h"
#include "tools/serve/session/session_frames.h"
#include "tools/serve/session/session_log.h"
#include "tools/serve/session/shared_scene.h"
#include "tools/serve/session/ticker.h"

#include <atomic>
#include <cstdint>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <vector>

namespace filiform::tools {

struct RemoteSessionOptions {
  double zoom_um = 300;
  SolverMethod method = SolverMethod::climb;
  std::optional<double> stiffness_N_m{};
  RemoteHandOptions hand{};
  std::string record{};               // write FILE, FILE.json and FILE.frames; empty: no recording
  std::atomic<bool>* news = nullptr;  // set when the session has a frame to send
  std::uint32_t number = 0;           // spreads the LOCAL MODELs of sessions over the periods
  std::size_t ticker = 0;             // its place among those of the scene
};

struct Subscription {
  double proxy_Hz = 0;   // 0: a PROXY for each HAND that a tick uses
  double model_Hz = 0;   // 0: no LOCAL MODEL
  double radius_um = 0;  // of the neighbourhood in a LOCAL MODEL; 0: none
};

class RemoteSession final : public Ticked {
 public:
  // Does not tick yet: add it to the ticker, and remove it before it is destroyed. Throws as Session and SessionLog do.
  RemoteSession(std::shared_ptr<SharedScene> scene, const RemoteSessionOptions& options);
  // Without finish(): leaves no recording.
  ~RemoteSession() override;

  // ---- the connection. takeProxy(): every PROXY, in order; takeModel(): the newest LOCAL MODEL.
  bool receive(const v1::Hand& hand) noexcept { return hand_->receive(hand); }
  bool takeProxy(v1::Proxy& proxy) noexcept;
  bool takeModel(ModelMaker::Frame& frame) noexcept { return models_.take(frame); }

  // ---- the ticker
  void tick(std::uint64_t period) noexcept override;
  void afterAll(double free_s) noexcept override;

  // ---- commands
  // See Session::jump(). A jump to a valid place is made as soon as its tile is in memory.
  void jump(const ProxyPlace& place, bool under_hand);
  // False if too many commands wait.
  bool send(const NavigationCommand& command);
  void subscribe(const Subscription& subscription);
  Subscription subscription() const;
  // Keeps the tiles of a cell in memory, as far as the budget goes; nullopt: none. Returns the number of its tiles.
  std::size_t follow(std::optional<std::uint32_t> cell);
  NavigationSnapshot now();
  // Housekeeping, every few milliseconds: waiting jumps, the recording. Returns new notes for the client.
  // `problems` gets what only the server's log may name.
  std::vector<std::string> serve(std::vector<std::string>* problems = nullptr);
  // Ends the recording. The ticker must not tick the session any more. Throws IoError, DeviceError.
  void finish();

  SharedScene& scene() const { return *scene_; }
  const RemoteSessionOptions& options() const { return options_; }
  double stiffness_N_m() const { return stiffness_N_m_; }
  static double most_force_N();
  std::uint64_t refusedHands() const { return hand_->refused(); }
  std::uint64_t ticks() const { return ticks_.load(std::memory_order_relaxed); }

 private:
  static std::uint32_t periodsOf(double rate_Hz);

  const std::shared_ptr<SharedScene> scene_;
  const RemoteSessionOptions options_;
  RemoteHand* hand_ = nullptr;  // the session's device
  mutable std::mutex mutex_;    // of session_ (except its tick), notes_, log failures, hold_
  std::unique_ptr<SessionLog> log_;
  std::unique_ptr<Session> session_;
  double stiffness_N_m_;
  std::optional<HoldId> hold_;
  Subscription subscription_;
  bool recording_failed_ = false, finished_ = false;

  SpscRing<v1::Proxy> proxies_{16};
  TripleBuffer<ModelMaker::Frame> models_;
  std::atomic<bool> jump_waits_{false};
  std::atomic<std::uint32_t> proxy_every_{0}, model_every_{0};
  std::atomic<double> radius_um_{0};
  std::atomic<std::uint64_t> ticks_{0};

  // The ticker's.
  const NavigationSnapshot* snapshot_ = nullptr;
  std::uint64_t proxy_at_ = 0;
  bool model_due_ = false, was_blocked_ = false;
  ModelMaker maker_;
  ModelMaker::Frame frame_;
};

}  // namespace filiform::tools
