// TouringClient: a client of a session that travels one route of its set after another, for benchmarks. Its hand is
// pulled ahead of the proxy along the route, as a user would. Thread rule: thread-compatible.
#pragma once

#include "solver/travel/routes/route.h"
#include "tools/lab/reference/service_socket.h"
#include "tools/serve/session/protocol.h"

#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

namespace filiform::tools {

class TouringClient {
 public:
  // Opens a session on the set at the beginning of the first route. Throws std::runtime_error.
  TouringClient(std::uint16_t port, const std::string& set, std::vector<filiform::Route> routes, double model_Hz);

  // Takes the frames that have come and sends one HAND. `now_ns`: any clock. Throws std::runtime_error if the
  // connection has ended.
  void step(std::int64_t now_ns);

  std::uint64_t hands() const { return hands_; }
  std::uint64_t proxies() const { return proxies_; }
  std::uint64_t waiting() const { return waiting_; }  // PROXY frames at absent tiles
  std::uint64_t legs() const { return legs_; }        // routes that were finished or given up
  std::vector<double>& roundTrips_us() { return round_trips_us_; }

 private:
  void take(const v1::Proxy& proxy, std::int64_t now_ns);
  void jump();

  ServiceSocket socket_;
  const std::vector<filiform::Route> routes_;
  std::size_t route_ = 0;
  v1::Proxy proxy_;
  v1::Hand hand_;
  Vector3d h_D_ = Vector3d::Zero();
  double reached_um_ = 0;
  std::uint64_t hands_ = 0, proxies_ = 0, waiting_ = 0, legs_ = 0, stuck_ = 0;
  std::vector<double> round_trips_us_;
};

}  // namespace filiform::tools
