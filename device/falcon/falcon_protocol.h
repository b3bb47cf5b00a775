// Encodes and decodes the packets of the Novint Falcon, and loads its firmware. The packets pass through the Falcon's
// USB-to-serial chip (FTDI). This file uses neither USB nor a clock: the caller passes bytes and times.
//
// With its run-time firmware, the device sends 16 bytes in answer to each 16 bytes of the host, and nothing else.
//
//   byte   0    1..4     5..8     9..12    13            14   15
//   out   '<'   motor 0  motor 1  motor 2  'A' + flags   'A'  '>'
//   in    '<'   count 0  count 1  count 2  'A' + flags   any  '>'
//
// Flags out: 1 homing, 2 green, 4 blue, 8 red lamp. Flags in: 1, 2, 4, 8 buttons 0..3; 16, 32, 64 encoder 0..2 homed.
// A number has 16 bits and a sign. Each of its four bytes is 'A' + 4 bits, the lowest bits first: "JFKP" is 0xfa59,
// -1447. Thread rule: an object belongs to one thread at a time. Functions marked noexcept do not allocate, lock or
// call the system.
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
  std::array<std::int16_t, 3> motors{};  // top, right, left: drive values; falcon_kinematics.h has sign and scale
  bool green = false, blue = false, red = false;
  bool homing = false;  // while true, the device looks for the encoders' index marks; a person moves the grip
};
FalconPacket packFalconCommand(const FalconCommand& command) noexcept;

struct FalconReport {
  std::array<std::int16_t, 3> counts{};  // top, right, left: encoder counts; falcon_kinematics.h has their scale
  std::uint8_t buttons = 0;              // bit 0 plus (right), 1 front, 2 centre, 3 minus (left)
  std::uint8_t homed = 0;                // bit i: encoder i has passed its index mark
  bool allHomed() const noexcept { return homed == 7; }
};

// Finds reports in a stream of bytes with gaps and noise. A report is the 16 bytes "in" above. If a byte does not fit,
// the first '<' is skipped, and the next '<' after it may begin the report.
class FalconReportParser {
 public:
  // Adds one byte. Returns true if it completed a report, which report() then returns. O(16).
  bool push(std::uint8_t byte) noexcept;
  const FalconReport& report() const noexcept { return report_; }  // the last one; zeros before the first
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

// The serial chip sends packets of at most 64 bytes, of which the first 2 are modem status. Calls each(payload) for
// every packet of a transfer that is longer than its status.
inline constexpr std::size_t kFtdiPacketBytes = 64, kFtdiStatusBytes = 2;
template <class Each>
void forEachFtdiPayload(std::span<const std::uint8_t> transfer, Each&& each) {
  for (; transfer.size() > kFtdiStatusBytes; transfer = transfer.subspan(std::min(transfer.size(), kFtdiPacketBytes)))
    each(transfer.subspan(kFtdiStatusBytes, std::min(transfer.size(), kFtdiPacketBytes) - kFtdiStatusBytes));
}

// A setting of the serial chip, sent as a USB control transfer: request type 0x40, index 0, no data.
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
inline constexpr FtdiRequest kEventAtReportEnd{6, 0x013e};  // send data on at each '>', not after the latency
inline constexpr FtdiRequest kLatency16ms{9, 16}, kLatency1ms{9, 1};
}  // namespace ftdi

// The requests, in order, that set the serial chip for the run-time firmware. FalconLoader ends with them; a
// device whose firmware runs already needs them too.
std::vector<FtdiRequest> falconRunRequests();

// Sizes (bytes) that a caller accepts for an image; real images have 7 to 9 kB.
inline constexpr std::size_t kFalconFirmwareLeast = 4096, kFalconFirmwareMost = 16384;

// Loads firmware, step by step. The caller does what next() says, and reports bytes by received() and failures by
// lost().
//
//   FalconLoader loader(image);
//   for (;;) {
//     const FalconLoader::Step& step = loader.next(time_s);
//     using Action = FalconLoader::Action;
//     if (step.action == Action::loaded || step.action == Action::failed) break;
//     if (step.action == Action::request) send(step.request);
//     if (step.action == Action::write) write(step.bytes);
//     if (step.action == Action::read) loader.received(readUntil(step.until_s));  // some bytes, or none at that time
//     if (step.action == Action::reopen) reopen();
//   }
//
// The host greets the boot loader until it answers, then writes the image; the boot loader echoes each byte. A wrong or
// late echo ends the attempt; the next attempt begins by reopening the device. Every attempt ends within
// kAttemptTime_s.
class FalconLoader {
 public:
  enum class Action : std::uint8_t { request, write, read, reopen, loaded, failed };
  struct Step {
    Action action = Action::failed;
    FtdiRequest request;                  // with Action::request
    std::span<const std::uint8_t> bytes;  // with Action::write
    double until_s = 0;                   // with Action::read
    std::string why;                      // with Action::failed: why the last attempt failed
  };

  // The image must outlive this object. `attempts`: 1 or more.
  explicit FalconLoader(std::span<const std::uint8_t> image, int attempts = kAttempts);

  // The next step. `time_s`: the time now, of a clock that does not go back. The step is valid until the next call of
  // next(). After `loaded` or `failed`, the same step is returned again.
  const Step& next(double time_s);
  // Bytes received, without status bytes, in any portions.
  void received(std::span<const std::uint8_t> bytes);
  // Ends the attempt: a request, write or read failed, or the device could not be reopened.
  void lost(const std::string& why);

  int attempt() const noexcept { return attempt_; }  // from 1
  double progress() const noexcept;                  // part of the image that was echoed in this attempt, 0..1

  static constexpr int kAttempts = 5;
  static constexpr int kGreetings = 10;           // an attempt
  static constexpr double kGreetingTime_s = 0.1;  // from a greeting to its answer
  static constexpr double kEchoTime_s = 1.0;      // from a block to its whole echo
  static constexpr double kAttemptTime_s = 15;    // a good attempt takes 2 to 3 s
  static constexpr std::size_t kBlockBytes = 62;  // of the image, written at once

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
