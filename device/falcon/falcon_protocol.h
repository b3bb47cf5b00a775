// Encodes and decodes the Novint Falcon's packets behind its serial bridge, and loads its firmware. No USB and no
// clock: the caller passes bytes and times.
//
// The host sends 16 bytes, the device answers with 16. The device never sends unasked.
//
//   byte   0    1..4     5..8     9..12    13                    14   15
//   out   '<'   motor 0  motor 1  motor 2  'A' + lamps, homing   'A'  '>'
//   in    '<'   count 0  count 1  count 2  'A' + buttons, homed   ?   '>'
//
// A number is 16 bit, signed, in four bytes 'A' + nibble, least significant first: "JFKP" is 0xfa59, -1447.
// Thread rule: objects are thread-compatible. Functions marked noexcept are haptic-safe and do not allocate.
#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <vector>

namespace filiform {

inline constexpr std::size_t kFalconPacketBytes = 16;
using FalconPacket = std::array<std::uint8_t, kFalconPacketBytes>;

struct FalconCommand {
  std::array<std::int16_t, 3> motors{};  // top, right, left
  bool green = false, blue = false, red = false;
  bool homing = false;  // start homing: search the encoders' index marks
};
FalconPacket packFalconCommand(const FalconCommand& command) noexcept;

struct FalconReport {
  std::array<std::int16_t, 3> counts{};  // top, right, left
  std::uint8_t buttons = 0;              // bit 0 plus (right), 1 front, 2 centre, 3 minus (left)
  std::uint8_t homed = 0;                // bit i: encoder i has passed its index mark
  bool allHomed() const noexcept { return homed == 7; }
};

// Finds reports in a stream of bytes with gaps and noise. A report begins with '<', ends with '>' 15 bytes later, and
// has only numbers in between. If not, its bytes are skipped and the search continues at the next '<'.
class FalconReportParser {
 public:
  // Adds one byte. Returns true if it completed a report, which report() then returns. O(16).
  bool push(std::uint8_t byte) noexcept;
  const FalconReport& report() const noexcept { return report_; }
  std::uint64_t reports() const noexcept { return reports_; }
  std::uint64_t skipped_bytes() const noexcept { return skipped_; }  // bytes that belong to no report
  // Drops the bytes of an unfinished report.
  void reset() noexcept { held_ = 0; }

 private:
  FalconPacket bytes_{};
  std::size_t held_ = 0;
  FalconReport report_;
  std::uint64_t reports_ = 0, skipped_ = 0;
};

// The serial bridge sends packets of at most 64 bytes, each after 2 bytes of modem status. Calls each(payload) for
// every packet of a transfer, without the status bytes. Payloads may be empty.
inline constexpr std::size_t kFtdiPacketBytes = 64, kFtdiStatusBytes = 2;
template <class Each>
void forEachFtdiPayload(std::span<const std::uint8_t> transfer, Each&& each) {
  for (; transfer.size() > kFtdiStatusBytes; transfer = transfer.subspan(std::min(transfer.size(), kFtdiPacketBytes)))
    each(transfer.subspan(kFtdiStatusBytes, std::min(transfer.size(), kFtdiPacketBytes) - kFtdiStatusBytes));
}

// A setting of the bridge: a vendor request without data, request type 0x40, index 0.
struct FtdiRequest {
  std::uint8_t request = 0;
  std::uint16_t value = 0;
  bool operator==(const FtdiRequest&) const = default;
};
namespace ftdi {
inline constexpr FtdiRequest kReset{0, 0}, kPurgeIn{0, 1}, kPurgeOut{0, 2};
inline constexpr FtdiRequest kDtrLow{1, 0x0100}, kDtrHigh{1, 0x0101}, kRtsLow{1, 0x0200};
inline constexpr FtdiRequest kNoFlowControl{2, 0};
inline constexpr FtdiRequest kBaud9600{3, 0x4138}, kBaud140k{3, 0x0015}, kBaud1500k{3, 0x0002};
inline constexpr FtdiRequest k8N1{4, 8};
inline constexpr FtdiRequest kEventAtReportEnd{6, 0x013e};  // pass data on at '>', not at the next latency tick
inline constexpr FtdiRequest kLatency16ms{9, 16}, kLatency1ms{9, 1};
}  // namespace ftdi

// The requests that set the bridge for the run-time firmware.
std::vector<FtdiRequest> falconRunRequests();

// Limits of the firmware's size; the real image has 7 to 9 kB.
inline constexpr std::size_t kFalconFirmwareLeast = 4096, kFalconFirmwareMost = 16384;

// Loads firmware, step by step. The caller does what next() says and reports the result.
//
//   FalconLoader loader(image);
//   for (;;) {
//     const FalconLoader::Step& step = loader.next(time_s);
//     using Action = FalconLoader::Action;
//     if (step.action == Action::loaded || step.action == Action::failed) break;
//     if (step.action == Action::request) send(step.request);
//     if (step.action == Action::write) write(step.bytes);
//     if (step.action == Action::read) loader.received(readUntil(step.until_s));
//     if (step.action == Action::reopen) reopen();
//   }
//
// The device sends a greeting, then echoes each byte of the image. A wrong or late echo ends the attempt; the next one
// starts with reopening the device. Every attempt ends within kAttemptTime_s.
class FalconLoader {
 public:
  enum class Action : std::uint8_t { request, write, read, reopen, loaded, failed };
  struct Step {
    Action action = Action::failed;
    FtdiRequest request;
    std::span<const std::uint8_t> bytes;  // valid until the next call
    double until_s = 0;
    std::string why;  // with failed: the reason of the last attempt's failure
  };

  // The image must outlive this object.
  explicit FalconLoader(std::span<const std::uint8_t> image, int attempts = kAttempts);

  // The next step, at the caller's time. Valid until the next call of any member.
  const Step& next(double time_s);
  // Bytes received, without status bytes, in any portions.
  void received(std::span<const std::uint8_t> bytes);
  // Ends the attempt: a request, write or read failed, or the device could not be reopened.
  void lost(const std::string& why);

  int attempt() const noexcept { return attempt_; }  // from 1
  double progress() const noexcept;                  // part of the image sent in this attempt, 0..1

  static constexpr int kAttempts = 5, kGreetings = 10;
  static constexpr double kGreetingTime_s = 0.1, kEchoTime_s = 1.0, kAttemptTime_s = 15;  // loading takes 2 to 3 s
  static constexpr std::size_t kBlockBytes = 62;

 private:
  enum class Phase : std::uint8_t { prepare, greet, handshake, image, finish, again, loaded, failed };
  void enter(Phase phase);
  void giveUp(const std::string& why);
  const Step& say(Action action);
  const Step& write(std::span<const std::uint8_t> bytes, double until_s);
  bool nextRequest(std::span<const FtdiRequest> requests);

  std::span<const std::uint8_t> image_;
  int attempts_, attempt_ = 1;
  Phase phase_ = Phase::prepare;
  std::size_t requested_ = 0;  // number of requests made in this phase
  int greetings_ = 0;
  bool started_ = false, waiting_ = false;  // the attempt has begun; a read is under way
  double attempt_until_s_ = 0, until_s_ = 0;
  std::vector<std::uint8_t> answer_;  // since the last write
  std::size_t sent_ = 0, echoed_ = 0;
  std::string why_;
  Step step_;
};

}  // namespace filiform
