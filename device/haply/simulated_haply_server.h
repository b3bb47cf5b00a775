// SimulatedHaplyServer: offers a SimulatedHaply by TCP on this machine, as the real service does. A thread of its own
// answers; it ends with this object. Thread rule: the owner's thread; the faults of the service on any thread.
#pragma once

#include "device/haply/simulated_haply.h"

#include <cstdint>
#include <memory>

namespace filiform {

class SimulatedHaplyServer {
 public:
  // Listens on 127.0.0.1; port 0: on a free one. The service must outlive this object, and no other thread may use it
  // meanwhile, apart from its faults and counts. Throws DeviceError if the port is taken.
  explicit SimulatedHaplyServer(SimulatedHaply& service, std::uint16_t port = 0);
  ~SimulatedHaplyServer();
  SimulatedHaplyServer(const SimulatedHaplyServer&) = delete;
  SimulatedHaplyServer& operator=(const SimulatedHaplyServer&) = delete;

  std::uint16_t port() const noexcept;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace filiform
