// Bytes of the Novint Falcon behind its serial bridge: packets of the run-time firmware, and the loading of that
// firmware. Pure: no USB, no clock of its own.
//
// The host asks with 16 bytes, the device answers with 16; it never speaks first.
//
//   byte   0    1..4     5..8     9..12    13                    14   15
//   out   '<'   motor 0  motor 1  motor 2  'A' + lamps, homing   'A'  '>'
//   in    '<'   count 0  count 1  count 2  'A' + buttons, homed   ?   '>'
//
// A number is 16 bit, signed, in four bytes 'A' + nibble, least significant first: "JFKP" is 0xfa59, -1447.
// Thread rule: objects are thread-compatible; what is noexcept here is haptic-safe, without allocation.
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
  bool homing = false;  // look for the homing marks of the encoders
};
FalconPacket packFalconCommand(const FalconCommand& command) noexcept;

struct FalconReport {
  std::array<std::int16_t, 3> counts{};  // top, right, left
  std::uint8_t buttons = 0;              // bit 0 plus (right), 1 front, 2 centre, 3 minus (left)
  std::uint8_t homed = 0;                // bit i: encoder i has passed its mark
  bool allHomed() const noexcept { return homed == 7; }
};

// Reports out of a stream of bytes that may lack some, or hold bytes of others: a report begins with '<', ends with '>'
// 15 bytes later and has only numbers in between, else nothing is taken from it and the search goes on at the next '<'.
class FalconReportParser {
 public:
  // One byte more; true if it completed a report, which report() then is. O(16).
  bool push(std::uint8_t byte) noexcept;
  const FalconReport& report() const noexcept { return report_; }
  std::uint64_t reports() const noexcept { return reports_; }
  std::uint64_t skipped_bytes() const noexcept { return skipped_; }  // that belonged to no report
  // Forgets the bytes of an unfinished report.
  void reset() noexcept { held_ = 0; }

 private:
  FalconPacket bytes_{};
  std::size_t held_ = 0;
  FalconReport report_;
  std::uint64_t reports_ = 0, skipped_ = 0;
};

// The serial bridge puts 2 bytes of modem status before each packet of 64 bytes or less that it sends. Calls
// each(payload) with what follows them, for every packet of a transfer; payloads may be empty.
inline constexpr std::size_t kFtdiPacketBytes = 64, kFtdiStatusBytes = 2;
template <class Each>
void forEachFtdiPayload(std::span<const std::uint8_t> transfer, Each&& each) {
  for (; transfer.size() > kFtdiStatusBytes; transfer = transfer.subspan(std::min(transfer.size(), kFtdiPacketBytes)))
    each(transfer.subspan(kFtdiStatusBytes, std::min(transfer.size(), kFtdiPacketBytes) - kFtdiStatusBytes));
}

// What is set in the bridge: a vendor request without data, request type 0x40, index 0.
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
inline constexpr FtdiRequest kEventAtReportEnd{6, 0x013e};  // flush at '>' at once, not at the next latency tick
inline constexpr FtdiRequest kLatency16ms{9, 16}, kLatency1ms{9, 1};
}  // namespace ftdi

// Sets the bridge for the run-time firmware.
std::vector<FtdiRequest> falconRunRequests();

// The image is 7 to 9 kB; anything of another order is not one.
inline constexpr std::size_t kFalconFirmwareLeast = 4096, kFalconFirmwareMost = 16384;

// Loads firmware, step by step: the caller does what next() says and tells it what came back.
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
// The device greets, then echoes each byte of the image; a wrong echo, or none in time, ends the attempt, and the next
// begins with the device opened anew. Whatever comes back, an attempt is over after kAttemptTime_s.
class FalconLoader {
 public:
  enum class Action : std::uint8_t { request, write, read, reopen, loaded, failed };
  struct Step {
    Action action = Action::failed;
    FtdiRequest request;
    std::span<const std::uint8_t> bytes;  // hold until the next call
    double until_s = 0;
    std::string why;  // of failed: what went wrong in the last attempt
  };

  // The image must outlive it.
  explicit FalconLoader(std::span<const std::uint8_t> image, int attempts = kAttempts);

  const Step& next(double time_s);
  // Payload without status bytes, in any pieces.
  void received(std::span<const std::uint8_t> bytes);
  // A request, write or read failed, or the device could not be opened again: ends the attempt.
  void lost(const std::string& why);

  int attempt() const noexcept { return attempt_; }  // from 1
  double progress() const noexcept;                  // of the image in this attempt, 0..1

  static constexpr int kAttempts = 5, kGreetings = 10;
  static constexpr double kGreetingTime_s = 0.1, kEchoTime_s = 1.0, kAttemptTime_s = 15;  // an image takes 2 to 3 s
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
  std::size_t requested_ = 0;  // of the phase
  int greetings_ = 0;
  bool started_ = false, waiting_ = false;  // the attempt; for an answer
  double attempt_until_s_ = 0, until_s_ = 0;
  std::vector<std::uint8_t> answer_;  // since the last write
  std::size_t sent_ = 0, echoed_ = 0;
  std::string why_;
  Step step_;
};

}  // namespace filiform
