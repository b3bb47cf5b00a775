#include "tools/lab/bench/serve/touring_client.h"

#include <algorithm>
#include <sstream>
#include <stdexcept>
#include <utility>

namespace filiform::tools {

namespace {

constexpr double kTourUm_m = 300 / 0.12;      // of the session's zoom
constexpr double kTourAhead_m = 0.005;        // of the hand, along the route
constexpr double kTourStep_m = 0.002;         // of the hand from one HAND to the next: 0.2 m/s at 100 Hz
constexpr std::uint64_t kTourPatience = 300;  // HANDs without progress

}  // namespace

TouringClient::TouringClient(std::uint16_t port, const std::string& set, std::vector<filiform::Route> routes,
                             double model_Hz)
    : socket_(port), routes_(std::move(routes)) {
  if (socket_.status() != 101) throw std::runtime_error("bench sessions: no session: " + socket_.head().substr(0, 80));
  socket_.ask("hello", "{}");
  const Vector3d& p_W = routes_.front().points().front().p_W;
  std::ostringstream params;
  params.precision(17);
  params << R"({"set":")" << set << R"(","hold_s":10,"at":[)" << p_W.x() << ',' << p_W.y() << ',' << p_W.z() << "]}";
  const std::string opened = socket_.ask("open", params.str());
  if (opened.find("\"result\"") == std::string::npos) throw std::runtime_error("bench sessions: " + opened);
  socket_.ask("subscribe", "{\"model_Hz\":" + std::to_string(model_Hz) + ",\"radius_um\":50}");
}

void TouringClient::jump() {
  ++legs_;
  reached_um_ = 0;
  stuck_ = 0;
  route_ = (route_ + 1) % routes_.size();
  const Vector3d& p_W = routes_[route_].points().front().p_W;
  std::ostringstream request;
  request.precision(17);
  request << R"({"jsonrpc":"2.0","id":0,"method":"jump","params":{"at":[)" << p_W.x() << ',' << p_W.y() << ','
          << p_W.z() << "]}}";
  socket_.sendText(request.str());
}

void TouringClient::take(const v1::Proxy& proxy, std::int64_t now_ns) {
  proxy_ = proxy;
  hand_.ack = proxy.seq;
  ++proxies_;
  waiting_ += (proxy.flags & v1::kFrontier) != 0;
  if (proxy.t_client_ns > 0) round_trips_us_.push_back(1e-3 * static_cast<double>(now_ns - proxy.t_client_ns));
}

void TouringClient::step(std::int64_t now_ns) {
  for (;;) {
    const ServiceSocket::Message message = socket_.read(std::chrono::milliseconds(0));
    if (message.kind == ServiceSocket::Message::Kind::none) break;
    if (message.kind == ServiceSocket::Message::Kind::close || message.kind == ServiceSocket::Message::Kind::ended)
      throw std::runtime_error("bench sessions: the connection ended: " + std::string(message.bytes));
    v1::Proxy proxy;
    const auto* const bytes = reinterpret_cast<const unsigned char*>(message.bytes.data());
    if (v1::decode(bytes, message.bytes.size(), proxy)) take(proxy, now_ns);
  }
  const filiform::Route& route = routes_[route_];
  ProxyPlace place;
  place.segment = {proxy_.cell, proxy_.segment};
  place.t = std::clamp<double>(proxy_.t, 0, 1);
  place.tile = proxy_.cell == UINT32_MAX ? kNoTile : 0;
  const filiform::Route::Progress progress = route.progress(place);
  const bool arriving = (proxy_.flags & v1::kJumpWaits) != 0 || !progress.connected;
  if (progress.connected && progress.arc_um > reached_um_ + 0.01) {
    reached_um_ = progress.arc_um;
    stuck_ = 0;
  } else if (++stuck_ > kTourPatience) {
    jump();
  }
  if (reached_um_ > route.length_um() - 1) jump();
  if (!arriving) {
    const Vector3d p_W(proxy_.p_W[0], proxy_.p_W[1], proxy_.p_W[2]);
    const Vector3d p_D(proxy_.p_D[0], proxy_.p_D[1], proxy_.p_D[2]);
    const Vector3d wanted_W = route.pointAt(progress.arc_um + kTourAhead_m * kTourUm_m);
    const Vector3d wanted_D = p_D + (wanted_W - p_W) / kTourUm_m;
    const Vector3d step_D = wanted_D - h_D_;
    h_D_ += step_D * std::min(1.0, kTourStep_m / std::max(1e-12, step_D.norm()));
    h_D_ = h_D_.cwiseMax(-0.06).cwiseMin(0.06);
  }
  hand_.seq = static_cast<std::uint32_t>(++hands_);
  hand_.t_client_ns = now_ns;
  for (int i = 0; i < 3; ++i) hand_.h_D[i] = h_D_[i];
  unsigned char bytes[v1::kHandBytes];
  v1::encode(hand_, bytes);
  if (!socket_.sendBinary(bytes)) throw std::runtime_error("bench sessions: the connection ended");
}

}  // namespace filiform::tools
