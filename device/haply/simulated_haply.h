// SimulatedHaply: a Haply Inverse Service without hardware, for tests, benchmarks and demonstrations. Each device is a
// mass with a spring and a damper in virtual time, one period a message. Faults can be set at any time.
//
//   SimulatedHaply service;
//   HaplyOptions options;
//   options.connect = service.connections();   // within this thread, in virtual time
//   HaplyDevice haply(options);
//
// SimulatedHaplyServer offers the same service by TCP, in real time. The service was written from Haply's
// documentation, not from a real service. Thread rule: one thread, except for the faults, which any thread may set.
#pragma once

#include "device/simulated/simulated_hand.h"
#include "device/web_socket/byte_stream.h"

#include <array>
#include <atomic>
#include <cstdint>
#include <functional>
#include <map>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

namespace filiform {

struct SimulatedHaplyStep {  // of the first device's hand; the frame has the service's axes, and the rest as its origin
  double time_s = 0;
  Eigen::Vector3d force_N, dx_m, p_m;  // the force that acted, the hand's motion, its position afterwards
};

struct SimulatedHaplyOptions {
  std::string version = "3.5.2";  // from 3.5 on, forces are named "vector", before "values"; the other is ignored
  std::vector<std::string> devices{"049D"};
  bool has_grip = true;
  bool is_wireless = true;   // the grip has three buttons; otherwise one
  bool is_mirrored = false;  // positions and forces are those of a left hand
  // Name and JSON value of what GET /inverse3/ID/config/NAME answers.
  std::map<std::string, std::string> settings{{"handedness", R"("right")"},
                                              {"preset", R"("arm_front_centered")"},
                                              {"damping", R"({"scalar":0})"},
                                              {"gravity_compensation", "true"}};
  HandParameters hand{};
  // The hands follow the aims of "filiform_aim". False: their targets are set by hand().
  bool is_led = false;
  // Time (s) of a steady clock: the hands move in this time, in steps of period_s. Empty: one period a message.
  std::function<double()> clock{};
  // With a clock: the target of the first hand (m, from its rest) at a time. Empty: as is_led says.
  std::function<Eigen::Vector3d(double time_s)> target{};
  std::function<void(const SimulatedHaplyStep&)> observe{};  // after each period of the first hand
  double period_s = 0.0005;                                  // of the hands, for each message
  int delay_samples = 1;  // messages from the effect of a command to the hand's motion, 0 to 2
  double device_damping_Ns_m = 0.5;
  int command_delay = 0;                     // messages after which a command takes effect, 0 to 7
  Eigen::Vector3d centre_H{0, -0.12, 0.15};  // where the hands rest (m, frame of the service)
};

struct SimulatedHaplyFaults {
  std::atomic<bool> calibrated{true}, ready{true}, power{true};
  std::atomic<bool> is_silent{false};      // messages are taken but not answered
  std::atomic<bool> holds{false};          // messages wait, and are answered afterwards, all at once
  std::atomic<bool> ends{false};           // every connection ends
  std::atomic<bool> ignores_force{false};  // whatever its name
  std::atomic<bool> leaves_out{false};     // what is zero, and the status
  std::atomic<bool> has_no_position{false};
  std::atomic<bool> sends_garbage{false};  // instead of states
  std::atomic<bool> sends_twice{false};    // each state
  std::atomic<std::uint32_t> buttons{0};   // of the grip
  std::atomic<double> jump_m{0};           // added to positions along x
};

class SimulatedHaply {
 public:
  explicit SimulatedHaply(const SimulatedHaplyOptions& options = {});
  ~SimulatedHaply();

  SimulatedHaplyFaults& faults() noexcept;
  // The first message of a session.
  std::string inventory() const;
  // Answers a message: one state. Empty if no answer is sent.
  std::string answer(std::string_view message);
  // Ends the forces of a session that has gone.
  void endSession() noexcept;

  // Of device number `index`: the force (N, frame of the service) that acts now; the hand, whose target may be set.
  Eigen::Vector3d force_H(std::size_t index = 0) const;
  SimulatedHand& hand(std::size_t index = 0);
  // Sets the orientation of the grip: w, x, y, z.
  void setOrientation(const std::array<double, 4>& orientation_H);
  const SimulatedHaplyOptions& options() const noexcept;
  std::uint64_t answers() const noexcept;  // number of states, any thread
  // Energy (J) that the forces have given to the hand; the most that a message gave or took. Exact, because a force is
  // constant between two messages.
  double given_J(std::size_t index = 0) const;
  double most_step_J(std::size_t index = 0) const;
  double strongest_N() const noexcept;  // the largest force that ever acted, any thread
  double acting_N() const noexcept;     // the size of the force that acts on the first device now, any thread

  // Makes connections within this thread: a read of an empty connection ends at its time, and time passes only in
  // reads, in sleeps, and by one period for each state. They must not outlive this object.
  std::function<std::unique_ptr<ByteStream>()> connections();

 private:
  double& now_s() noexcept;  // virtual time, of connections()

  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace filiform
