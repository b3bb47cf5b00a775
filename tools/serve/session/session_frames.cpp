#include "tools/serve/session/session_frames.h"

#include "solver/workspace/workspace.h"

#include <algorithm>
#include <cmath>

namespace filiform::tools {

namespace {

constexpr double kLeastRadius_m = 0.0005, kMostRadius_m = 0.02;
constexpr float kModelTime_s = 0.1F;

void putVector(const Vector3d& v, double (&out)[3]) noexcept {
  for (int i = 0; i < 3; ++i) out[i] = v[i];
}
void putVector(const Vector3d& v, float (&out)[3]) noexcept {
  for (int i = 0; i < 3; ++i) out[i] = static_cast<float>(v[i]);
}

std::int64_t nanoseconds(double time_s) noexcept { return static_cast<std::int64_t>(std::llround(time_s * 1e9)); }

}  // namespace

v1::Proxy proxyOf(const NavigationSnapshot& now, const RemoteHand& hand) noexcept {
  v1::Proxy proxy;
  proxy.hand = hand.used().hand.seq;
  proxy.t_client_ns = hand.used().hand.t_client_ns;
  proxy.mode = static_cast<std::uint8_t>(now.mode == NavigationMode::free);
  const bool placed = now.mode == NavigationMode::constrained && now.place.valid();
  int flags = 0;
  if (now.frontier) flags |= v1::kFrontier;
  if (now.capped) flags |= v1::kCapped;
  if (hand.isSilent()) flags |= v1::kSilent;
  if (hand.isBlocked()) flags |= v1::kUnreadable;
  if (!placed && now.mode == NavigationMode::constrained) flags |= v1::kNoPlace;
  proxy.flags = static_cast<std::uint16_t>(flags);
  putVector(now.p_W, proxy.p_W);
  putVector(now.p_D, proxy.p_D);
  putVector(now.force_N, proxy.force_N);
  if (placed) {
    proxy.cell = now.place.segment.cell;
    proxy.segment = now.place.segment.segment;
    proxy.t = static_cast<float>(now.place.t);
  }
  proxy.visited = static_cast<std::uint16_t>(std::min<std::uint32_t>(now.visited, UINT16_MAX));
  proxy.t_server_ns = nanoseconds(now.time_s);
  return proxy;
}

void ModelMaker::make(const NavigationSnapshot& now, const RemoteHand& hand, const GraphView& graph,
                      double stiffness_N_m, double most_N, double radius_um, Frame& frame) noexcept {
  v1::ModelHead model;
  model.hand = hand.used().hand.seq;
  model.t_server_ns = nanoseconds(now.time_s);
  putVector(now.h_D, model.h_D);
  putVector(now.force_N, model.force_N);
  putVector(now.p_W, model.p_W);
  putVector(now.p_D, model.p_D);
  model.ttl_s = kModelTime_s;
  model.most_N = static_cast<float>(most_N);
  const double um_m = now.zoom_um / Workspace::kZoomSpan_m;
  model.um_m = static_cast<float>(um_m);
  const Eigen::Vector4d rotation = now.rotation_WD.coeffs();  // x y z w
  for (int i = 0; i < 4; ++i) model.rotation_WD[i] = static_cast<float>(rotation[i]);

  const bool placed = now.mode == NavigationMode::constrained && now.place.valid();
  around_.collect(graph, placed ? now.place : ProxyPlace{}, radius_um);
  const std::span<const Vector3d> nodes = around_.nodes();
  const bool pulls = placed && !hand.isSilent() && !hand.isBlocked();
  if (!pulls) spring_.reset();
  if (placed) {
    model.cell = now.place.segment.cell;
    model.segment = now.place.segment.segment;
    Vector3d along_D = Vector3d::Zero();
    double radius_m = 2 * kLeastRadius_m;
    if (nodes.size() >= 2 && !now.place.at_node) {
      const Vector3d along_W = nodes[1] - nodes[0];
      const double length_um = along_W.norm();
      if (length_um > 0) {
        along_D = now.rotation_WD.conjugate() * (along_W / length_um);
        radius_m = std::min((now.p_W - nodes[0]).norm(), (now.p_W - nodes[1]).norm()) / um_m;
      }
    }
    model.radius_m = static_cast<float>(std::clamp(radius_m, kLeastRadius_m, kMostRadius_m));
    Eigen::Matrix3d stiffness = Eigen::Matrix3d::Zero();
    if (pulls)
      stiffness = spring_.about(now.h_D, now.anchor_D - now.h_D, now.force_N, stiffness_N_m, along_D).stiffness_N_m;
    const double values[6] = {stiffness(0, 0), stiffness(0, 1), stiffness(0, 2),
                              stiffness(1, 1), stiffness(1, 2), stiffness(2, 2)};
    for (int i = 0; i < 6; ++i) model.stiffness_N_m[i] = static_cast<float>(values[i]);
  }
  const bool wanted = radius_um > 0;
  model.nodes = wanted ? static_cast<std::uint16_t>(nodes.size()) : 0;
  model.links = wanted ? static_cast<std::uint16_t>(around_.links().size()) : 0;
  model.full = wanted && around_.full() ? 1 : 0;
  unsigned char* const at = frame.bytes.data();
  v1::encode(model, at);
  for (std::size_t i = 0; i < model.nodes; ++i)
    for (int axis = 0; axis < 3; ++axis)
      v1::putFloat(at + v1::kModelHeadBytes + 12 * i + 4 * static_cast<std::size_t>(axis),
                   static_cast<float>(nodes[i][axis] - now.p_W[axis]));
  for (std::size_t i = 0; i < model.links; ++i)
    for (std::size_t end = 0; end < 2; ++end)
      v1::put(at + v1::kModelHeadBytes + 12 * std::size_t{model.nodes} + 4 * i + 2 * end, around_.links()[i][end], 2);
  frame.size = static_cast<std::uint32_t>(v1::modelBytes(model));
}

}  // namespace filiform::tools
