#include "device/bridge/bridge_protocol.h"
#include "tests/fuzz/fuzz_bytes.h"
#include "tools/bridges/bridge_force.h"

#include <cmath>

namespace filiform::fuzz {

// Packets, each preceded by the time since the last one (ms) and its length. COMMANDs drive the force of a bridge.
void fuzzBridge(Input input) {
  constexpr double kPeak_N = 8;
  bridge_force force;
  bridge_force_begin(&force, kPeak_N, 1000);
  std::int64_t now_ns = 1'000'000'000, accepted_ns = now_ns;
  Taker in(input);
  double p_D[3] = {0, 0, 0}, v_D[3] = {0, 0, 0}, out_N[3];
  while (!in.empty()) {
    now_ns += 1'000'000LL * in.number<std::uint8_t>();
    const Input bytes = in.some(in.number<std::uint8_t>());
    fb_packet packet{};
    if (fb_decode(bytes.data(), bytes.size(), &packet) != 0) {
      unsigned char again[FB_MOST_BYTES];
      require(fb_encode(&packet, again) == bytes.size(), "a packet has the size of its kind");
      fb_packet twice{};
      require(fb_decode(again, bytes.size(), &twice) != 0 && twice.kind == packet.kind && twice.seq == packet.seq,
              "a packet comes back as it was");
      if (packet.kind == FB_HELLO) require(packet.is.hello.name[FB_NAME_BYTES - 1] == 0, "a name ends");
      if (packet.kind == FB_BYE) bridge_force_end(&force, now_ns);
      if (packet.kind == FB_STATE) {  // where the hand is
        for (int i = 0; i < 3; ++i) {
          p_D[i] = packet.is.state.p_D[i];
          v_D[i] = packet.is.state.v_D[i];
        }
      }
      if (packet.kind == FB_COMMAND &&
          bridge_force_command(&force, packet.seq, &packet.is.command, packet.seq % 7 != 0, now_ns) != 0)
        accepted_ns = now_ns;
    }
    bridge_force_at(&force, p_D, v_D, now_ns, out_N);
    require(fb_finite(out_N, 3) != 0, "the force is finite");
    require(std::sqrt(out_N[0] * out_N[0] + out_N[1] * out_N[1] + out_N[2] * out_N[2]) <= kPeak_N * (1 + 1e-9),
            "the force is at most the peak force");
    require(now_ns - accepted_ns < 70'000'000 || (out_N[0] == 0 && out_N[1] == 0 && out_N[2] == 0),
            "there is no force 70 ms after the last command");
  }
}

}  // namespace filiform::fuzz
