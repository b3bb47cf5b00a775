#include "device/falcon/falcon_protocol.h"

#include <cstdio>

namespace filiform {
namespace {

constexpr std::uint8_t kFirst = '<', kLast = '>', kZero = 'A';
constexpr std::size_t kFlags = 13, kUnknown = 14, kEnd = 15;
constexpr std::uint8_t kHomingBit = 0x01, kGreenBit = 0x02, kBlueBit = 0x04, kRedBit = 0x08;

bool belongs(std::size_t at, std::uint8_t byte) noexcept {
  if (at == 0) return byte == kFirst;
  if (at == kEnd) return byte == kLast;
  if (at == kUnknown) return byte != kFirst && byte != kLast;
  const int value = byte - kZero;
  return value >= 0 && value <= (at == kFlags ? 0x7f : 0x0f);
}

constexpr std::array<std::uint8_t, 3> kGreeting{0x0a, 0x43, 0x0d};
constexpr std::array<std::uint8_t, 4> kGreetingAnswer{0x0a, 0x44, 0x2c, 0x0d};
constexpr std::array<std::uint8_t, 1> kHandshake{0x41};
constexpr std::size_t kAnswerMost = 256;

constexpr std::array kPrepareRequests{ftdi::kPurgeIn,  ftdi::kPurgeOut, ftdi::kLatency16ms,
                                      ftdi::kBaud9600, ftdi::k8N1,      ftdi::kNoFlowControl,
                                      ftdi::kRtsLow,   ftdi::kDtrLow,   ftdi::kDtrHigh};
constexpr std::array kHandshakeRequests{ftdi::kDtrLow, ftdi::kBaud140k};

}  // namespace

FalconPacket packFalconCommand(const FalconCommand& command) noexcept {
  FalconPacket packet;
  packet[0] = kFirst;
  for (std::size_t motor = 0; motor < 3; ++motor) {
    const auto value = static_cast<std::uint16_t>(command.motors[motor]);
    for (std::size_t nibble = 0; nibble < 4; ++nibble)
      packet[1 + 4 * motor + nibble] = static_cast<std::uint8_t>(kZero + ((value >> (4 * nibble)) & 0x0f));
  }
  packet[kFlags] =
      static_cast<std::uint8_t>(kZero + (command.homing ? kHomingBit : 0) + (command.green ? kGreenBit : 0) +
                                (command.blue ? kBlueBit : 0) + (command.red ? kRedBit : 0));
  packet[kUnknown] = kZero;
  packet[kEnd] = kLast;
  return packet;
}

bool FalconReportParser::push(std::uint8_t byte) noexcept {
  bytes_[held_++] = byte;
  // All bytes but the last fit a report. If the last does not, the report may have begun at a later byte.
  const auto beginsAt = [&](std::size_t start) {
    for (std::size_t i = start; i < held_; ++i)
      if (!belongs(i - start, bytes_[i])) return false;
    return true;
  };
  if (!belongs(held_ - 1, byte)) {
    std::size_t start = 1;
    while (start < held_ && !beginsAt(start)) ++start;
    std::copy(bytes_.begin() + static_cast<std::ptrdiff_t>(start), bytes_.begin() + static_cast<std::ptrdiff_t>(held_),
              bytes_.begin());
    held_ -= start;
    skipped_ += start;
  }
  if (held_ < kFalconPacketBytes) return false;
  for (std::size_t encoder = 0; encoder < 3; ++encoder) {
    std::uint16_t value = 0;
    for (std::size_t nibble = 0; nibble < 4; ++nibble)
      value = static_cast<std::uint16_t>(value | (bytes_[1 + 4 * encoder + nibble] - kZero) << (4 * nibble));
    report_.counts[encoder] = static_cast<std::int16_t>(value);
  }
  const int flags = bytes_[kFlags] - kZero;
  report_.buttons = static_cast<std::uint8_t>(flags & 0x0f);
  report_.homed = static_cast<std::uint8_t>(flags >> 4);
  held_ = 0;
  ++reports_;
  return true;
}

std::vector<FtdiRequest> falconRunRequests() {
  return {ftdi::kNoFlowControl, ftdi::k8N1, ftdi::kLatency1ms, ftdi::kBaud1500k, ftdi::kPurgeIn, ftdi::kPurgeOut};
}

FalconLoader::FalconLoader(std::span<const std::uint8_t> image, int attempts) : image_(image), attempts_(attempts) {
  answer_.reserve(kAnswerMost);
}

void FalconLoader::enter(Phase phase) {
  phase_ = phase;
  requested_ = 0;
  waiting_ = false;
  answer_.clear();
}

void FalconLoader::giveUp(const std::string& why) {
  why_ = why;
  enter(attempt_ < attempts_ ? Phase::again : Phase::failed);
}

void FalconLoader::lost(const std::string& why) {
  if (phase_ != Phase::loaded && phase_ != Phase::failed) giveUp(why);
}

double FalconLoader::progress() const noexcept {
  return image_.empty() ? 1.0 : static_cast<double>(echoed_) / static_cast<double>(image_.size());
}

const FalconLoader::Step& FalconLoader::say(Action action) {
  step_.action = action;
  step_.until_s = until_s_;
  return step_;
}

const FalconLoader::Step& FalconLoader::write(std::span<const std::uint8_t> bytes, double until_s) {
  answer_.clear();
  waiting_ = true;
  until_s_ = until_s;
  step_.bytes = bytes;
  return say(Action::write);
}

bool FalconLoader::nextRequest(std::span<const FtdiRequest> requests) {
  if (requested_ == requests.size()) return false;
  step_.request = requests[requested_++];
  return true;
}

const FalconLoader::Step& FalconLoader::next(double time_s) {
  for (;;) {
    if (!started_) {
      started_ = true;
      attempt_until_s_ = time_s + kAttemptTime_s;
    }
    const bool at_work = phase_ != Phase::again && phase_ != Phase::loaded && phase_ != Phase::failed;
    if (at_work && time_s > attempt_until_s_) giveUp("the boot loader took too long");
    const bool in_time = time_s < until_s_;
    switch (phase_) {
      case Phase::prepare:
        if (nextRequest(kPrepareRequests)) return say(Action::request);
        greetings_ = 0;
        enter(Phase::greet);
        break;

      case Phase::greet:
        if (std::search(answer_.begin(), answer_.end(), kGreetingAnswer.begin(), kGreetingAnswer.end()) !=
            answer_.end()) {
          enter(Phase::handshake);
          break;
        }
        if (waiting_ && in_time) return say(Action::read);
        if (greetings_ == kGreetings) {
          giveUp("the boot loader did not answer its greeting");
          break;
        }
        ++greetings_;
        return write(kGreeting, time_s + kGreetingTime_s);

      case Phase::handshake:
        if (nextRequest(kHandshakeRequests)) return say(Action::request);
        // An answer to an earlier greeting may come first.
        if (!answer_.empty() && answer_.back() == kHandshake[0]) {
          sent_ = echoed_ = 0;
          enter(Phase::image);
          break;
        }
        if (!waiting_) return write(kHandshake, time_s + kEchoTime_s);
        if (in_time) return say(Action::read);
        giveUp("the boot loader did not answer at the loading speed");
        break;

      case Phase::image: {
        if (echoed_ == image_.size()) {
          enter(Phase::finish);
          break;
        }
        if (echoed_ < sent_) {
          if (in_time) return say(Action::read);
          giveUp("the echo stopped after " + std::to_string(echoed_) + " of " + std::to_string(image_.size()) +
                 " bytes");
          break;
        }
        const auto block = image_.subspan(sent_, std::min(kBlockBytes, image_.size() - sent_));
        sent_ += block.size();
        return write(block, time_s + kEchoTime_s);
      }

      case Phase::finish:
        if (nextRequest(falconRunRequests())) return say(Action::request);
        enter(Phase::loaded);
        break;

      case Phase::again:
        ++attempt_;
        started_ = false;
        enter(Phase::prepare);
        return say(Action::reopen);

      case Phase::loaded:
        return say(Action::loaded);

      case Phase::failed:
        step_.why = why_;
        return say(Action::failed);
    }
  }
}

void FalconLoader::received(std::span<const std::uint8_t> bytes) {
  if (phase_ == Phase::greet || phase_ == Phase::handshake) {
    for (const std::uint8_t byte : bytes)
      if (answer_.size() < kAnswerMost) answer_.push_back(byte);
    return;
  }
  if (phase_ != Phase::image) return;
  for (const std::uint8_t byte : bytes) {
    if (echoed_ == sent_ || byte != image_[echoed_]) {
      char text[96];
      std::snprintf(text, sizeof text, "byte %zu of the firmware came back as 0x%02x", echoed_, byte);
      giveUp(text);
      return;
    }
    ++echoed_;
  }
}

}  // namespace filiform
