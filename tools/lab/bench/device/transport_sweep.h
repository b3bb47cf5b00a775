// The energy that a hand receives through the transports' real sockets, in real time: a bridge by seqpacket and by
// datagrams in a process of its own, and the Haply service by TCP, from this process and through a device process. A
// spring of ForceLaw with the passivity controller pulls a simulated hand that a person leads to and fro. The hand's
// end of the socket sums the energy, exactly. Thread rule: one run at a time.
#pragma once

#include <cstdint>
#include <functional>
#include <string>

namespace filiform::tools {

enum class SweepTransport : std::uint8_t { seqpacket, udp, haply, process };
const char* toString(SweepTransport transport);

struct SweepCell {
  SweepTransport transport = SweepTransport::seqpacket;
  double stiffness_N_m = 200, period_s = 0.001;  // of the exchanges: a force is as late as this
  bool stalls = false;                           // the loop stalls for 12 to 45 ms, 976 times in ten minutes, seeded
  // Found:
  std::uint64_t exchanges = 0, unanswered = 0;
  std::uint64_t losses = 0;  // of the device, as on a busy machine; it is then opened again
  double longest_gap_s = 0;  // between two states
  double ramped_s = 0;       // fades and ramps that follow from the gaps, if the far end renders the model
  double strongest_N = 0;
  double given_J = 0;   // the most energy given in any window
  double beyond_J = 0;  // the most beyond the bound of that window
};

// Runs the cell for 2 s of ramps, and `seconds` that are measured. `folder`: for sockets. `stop` ends it early.
// Throws std::runtime_error and DeviceError if the transport does not work, or is lost 100 times.
void runSweepCell(SweepCell& cell, double seconds, const std::string& folder, const std::function<bool()>& stop = {});

}  // namespace filiform::tools
