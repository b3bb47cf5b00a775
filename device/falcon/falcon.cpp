#include "device/falcon/falcon.h"

#include <algorithm>
#include <cerrno>
#include <cmath>
#include <cstdlib>
#include <cstring>
#include <fstream>
#include <iterator>
#include <system_error>
#include <utility>

namespace filiform {
namespace {

constexpr std::uint8_t kInterface = 0, kIn = 0x81, kOut = 0x02;
constexpr std::size_t kInBytes = 512, kOutBytes = 64;
constexpr double kControlTime_s = 0.5, kWriteTime_s = 0.5, kReopenPause_s = 0.1;
constexpr double kProbeTime_s = 0.1, kFirstReportTime_s = 1.0, kProbeAnswer_s = 0.01, kZeroTime_s = 0.01;
constexpr double kPeak_N = 8;
constexpr double kFarthest_m = 0.1;  // from the centre, on any axis: out of the mechanism's reach
// Limits of the time between two accepted reports, for the speed check. After a gap, no report is accepted at once.
constexpr double kLeastInterval_s = 1e-3, kMostInterval_s = 2e-3;
constexpr double kLeastWindow_s = 0.005;  // of the velocity: a shorter one shows the encoders' rounding

std::string rejection(UsbStatus status) { return std::string("a USB transfer failed: ") + toString(status); }

}  // namespace

Falcon::Falcon(UsbTransport& transport, FalconOptions options)
    : transport_(transport), options_(std::move(options)), gate_(kPeak_N, options_.ramp_s) {
  if (options_.firmware.empty())
    if (const char* named = std::getenv(kFalconFirmwareVariable)) options_.firmware = named;
  capabilities_.name = "Novint Falcon";
  capabilities_.workspace_lo_D.setConstant(-kFalconReach_m);
  capabilities_.workspace_hi_D.setConstant(kFalconReach_m);
  capabilities_.peak_force_N = kPeak_N;
  capabilities_.max_stiffness_N_m = 500;
  capabilities_.resolution_m = 5e-5;
  capabilities_.nominal_rate_Hz = 1000;
  capabilities_.delay_samples = 1;
  capabilities_.buttons = 4;
  capabilities_.needs_homing = true;
  capabilities_.paces_loop = true;
}

Falcon::~Falcon() { close(); }

FalconOptions falconOptions(const std::string& argument) {
  FalconOptions options;
  const std::size_t comma = argument.rfind(',');
  options.firmware = argument.substr(0, comma);
  if (options.firmware.starts_with(':')) options.firmware.erase(0, 1);
  if (comma != std::string::npos) options.bus_path = argument.substr(comma + 1);
  return options;
}

UsbDeviceInfo Falcon::find() const {
  std::vector<UsbDeviceInfo> found;
  for (UsbDeviceInfo& info : transport_.devices())
    if (info.vendor == kFalconVendor && info.product == kFalconProduct &&
        (options_.bus_path.empty() || info.bus_path == options_.bus_path || info.serial == options_.bus_path))
      found.push_back(std::move(info));
  if (found.size() == 1) return found.front();
  if (found.size() > 1)
    throw DeviceError("several Falcons are plugged in: name one by its USB socket, as in falcon," +
                      found.front().bus_path + " or falcon," + found.back().bus_path);
  throw DeviceError("no Novint Falcon (USB 0403:cb48) is plugged in" +
                    (options_.bus_path.empty() ? std::string() : " at " + options_.bus_path) +
                    ": connect its USB cable and its power supply");
}

void Falcon::connect(const UsbDeviceInfo& info) {
  usb_ = transport_.open(info);
  usb_->claim(kInterface);
  in_ = usb_->makeTransfer(kIn, kInBytes);
  out_ = usb_->makeTransfer(kOut, kOutBytes);
  parser_.reset();
}

void Falcon::disconnect() noexcept {
  in_.reset();
  out_.reset();
  usb_.reset();
}

void Falcon::prepareToRun() {
  const auto request = [this](const FtdiRequest& what) {
    usb_->control({.request_type = 0x40, .request = what.request, .value = what.value}, {}, kControlTime_s);
  };
  for (const FtdiRequest& what : falconRunRequests()) request(what);
  if (options_.event_character) request(ftdi::kEventAtReportEnd);
}

bool Falcon::answersAsRunning(double patience_s) noexcept {
  const std::uint64_t before = parser_.reports();
  const double end_s = usb_->time_s() + patience_s;
  takeReports();
  while (parser_.reports() == before && usb_->time_s() < end_s && !usb_->gone()) {
    deadline_s_ = usb_->time_s() + kZeroTime_s;
    send({}, true);
    const double next_s = usb_->time_s() + kProbeAnswer_s;
    while (parser_.reports() == before && usb_->time_s() < next_s && !usb_->gone()) {
      usb_->handleEvents(next_s - usb_->time_s());
      takeReports();
    }
  }
  return parser_.reports() != before;
}

std::vector<std::uint8_t> Falcon::readFirmware() const {
  const std::string& path = options_.firmware;
  if (path.empty())
    throw DeviceError(
        std::string(
            "the Falcon has no firmware loaded, and none was given. filiform may not ship Novint's firmware: look for "
            "a .bin file of 7 to 9 kB in the driver or SDK that came with the device, and pass it as --device "
            "falcon:FILE or in ") +
        kFalconFirmwareVariable);
  std::ifstream file(path, std::ios::binary);
  if (!file) throw DeviceError(path + ": cannot open the firmware: " + std::generic_category().message(errno));
  std::vector<std::uint8_t> image(kFalconFirmwareMost + 1);
  file.read(reinterpret_cast<char*>(image.data()), static_cast<std::streamsize>(image.size()));
  if (file.bad()) throw DeviceError(path + ": cannot read the firmware");
  image.resize(static_cast<std::size_t>(file.gcount()));
  if (image.size() < kFalconFirmwareLeast || image.size() > kFalconFirmwareMost)
    throw DeviceError(path + ": not Falcon firmware: the file must have " + std::to_string(kFalconFirmwareLeast) +
                      " to " + std::to_string(kFalconFirmwareMost) + " bytes");
  return image;
}

void Falcon::load(std::span<const std::uint8_t> image) {
  FalconLoader loader(image);
  for (;;) {
    const FalconLoader::Step& step = loader.next(transport_.time_s());
    try {
      switch (step.action) {
        case FalconLoader::Action::request:
          usb_->control({.request_type = 0x40, .request = step.request.request, .value = step.request.value}, {},
                        kControlTime_s);
          break;
        case FalconLoader::Action::write: {
          std::copy(step.bytes.begin(), step.bytes.end(), out_->buffer().begin());
          const UsbStatus status = usb_->run(*out_, step.bytes.size(), kWriteTime_s);
          if (status != UsbStatus::done) loader.lost(rejection(status));
          break;
        }
        case FalconLoader::Action::read:
          if (!in_->pending() && !in_->submit(kInBytes)) {
            loader.lost(rejection(in_->status()));
            break;
          }
          usb_->handleEvents(std::max(step.until_s - transport_.time_s(), 0.0));
          if (in_->pending()) break;
          if (in_->status() == UsbStatus::done)
            forEachFtdiPayload(in_->data(), [&](std::span<const std::uint8_t> bytes) { loader.received(bytes); });
          else
            loader.lost(rejection(in_->status()));
          break;
        case FalconLoader::Action::reopen:
          disconnect();
          transport_.pause(kReopenPause_s);
          connect(find());
          break;
        case FalconLoader::Action::loaded:
          return;
        case FalconLoader::Action::failed:
          throw DeviceError("the Falcon's firmware could not be loaded in " + std::to_string(loader.attempt()) +
                            " attempts: " + step.why +
                            "; unplug USB and power, wait, and try again, with and without "
                            "a hub in between");
      }
    } catch (const UsbError& error) {
      loader.lost(error.what());
    }
  }
}

void Falcon::open() {
  close();
  counters_ = {};
  state_ = {};
  state_.status = DeviceStatus::booting;
  try {
    connect(find());
    prepareToRun();
    // A longer probe reportedly makes the following load fail; so does any other traffic before the probe.
    if (!answersAsRunning(kProbeTime_s)) {
      const std::vector<std::uint8_t> image = readFirmware();
      disconnect();
      transport_.pause(kReopenPause_s);
      connect(find());
      load(image);
      if (options_.event_character) prepareToRun();
      if (!answersAsRunning(kFirstReportTime_s))
        throw DeviceError(
            options_.firmware +
            ": the Falcon accepted this firmware but does not answer: use the firmware made for the Falcon");
    }
  } catch (...) {
    disconnect();
    state_.status = DeviceStatus::closed;
    throw;
  }
  sent_N_ = taken_N_ = Eigen::Vector3d::Zero();
  opened_s_ = report_s_ = usb_->time_s();
  refused_in_a_row_ = unanswered_ = 0;
  state_.status = DeviceStatus::homing;
}

void Falcon::close() noexcept {
  if (usb_) sendZeros({}, usb_->time_s() + kZeroPackets * kZeroTime_s);
  disconnect();
  state_.status = DeviceStatus::closed;
  state_.v_D.setZero();
}

DeviceState Falcon::exchange(const Wrench& wrench) noexcept {
  state_.sent_N = sent_N_;
  if (state_.status == DeviceStatus::closed || state_.status == DeviceStatus::fault) return state_;
  deadline_s_ = usb_->time_s() + kAnswerTime_s;
  // Discard reports that answer an earlier command.
  usb_->handleEvents(0);
  takeReports();
  const double begin_s = usb_->time_s();
  // Count silence from a command, so that a paused host does not lose the device.
  if (unanswered_ > 0 && begin_s - asked_s_ > kLost_s) fail();
  if (state_.status == DeviceStatus::fault) return state_;

  const bool stale = DeviceGate::isStale(begin_s, report_s_);
  const Command command = commandFor(gate_.pass(wrench, begin_s, report_s_).force_N);
  // If the last command is not taken yet, the device still acts on it.
  if (send(command.packet, stale) && state_.status != DeviceStatus::fault) sent_N_ = command.force_N;
  state_.sent_N = sent_N_;
  bool answered = false;
  while (unanswered_ > 0 && state_.status != DeviceStatus::fault) {
    const double left_s = deadline_s_ - usb_->time_s();
    if (left_s <= 0) break;
    usb_->handleEvents(left_s);
    answered = takeReports() || answered;
  }
  // With two commands under way, each report would answer the one before: one sample more delay, permanently.
  if (answered)
    unanswered_ = 0;
  else
    ++counters_.unanswered;
  counters_.reports = parser_.reports();
  counters_.skipped_bytes = parser_.skipped_bytes();
  return state_;
}

Falcon::Command Falcon::commandFor(const Eigen::Vector3d& force_N) const noexcept {
  Command command;
  if (state_.status != DeviceStatus::ready) {
    command.packet.red = command.packet.homing = true;
    return command;
  }
  command.packet.green = true;
  const auto torques_Nm = falconTorques(p_F_, force_N);
  if (!torques_Nm) return command;
  command.packet.motors = falconMotors(*torques_Nm, options_.motor_per_Nm);
  command.force_N = falconMotorShare(*torques_Nm, options_.motor_per_Nm) * force_N;
  return command;
}

// Returns false if nothing was sent.
bool Falcon::send(const FalconCommand& command, bool at_once) noexcept {
  // The device does not take the last command. A newer command waits; a zero cancels it.
  if (out_->pending() && (!at_once || !out_->cancel(std::max(0.0, deadline_s_ - usb_->time_s())))) return false;
  const UsbStatus last = out_->status();
  if (last == UsbStatus::done) taken_N_ = sent_N_;
  if (last == UsbStatus::stalled || last == UsbStatus::failed) ++counters_.transfer_errors;
  const FalconPacket packet = packFalconCommand(command);
  std::copy(packet.begin(), packet.end(), out_->buffer().begin());
  if (unanswered_ == 0) asked_s_ = usb_->time_s();
  unanswered_ = std::min(unanswered_ + 1, 2);
  const bool sent = out_->submit(packet.size());
  if (!sent) ++counters_.transfer_errors;
  if (out_->status() == UsbStatus::gone || usb_->gone()) fail();
  return sent;
}

bool Falcon::takeReports() noexcept {
  bool any = false;
  while (!in_->pending()) {
    const UsbStatus status = in_->status();
    if (status == UsbStatus::done) {
      forEachFtdiPayload(in_->data(), [&](std::span<const std::uint8_t> bytes) {
        for (const std::uint8_t byte : bytes)
          if (parser_.push(byte)) {
            any = true;
            unanswered_ = std::max(unanswered_ - 1, 0);
            asked_s_ = usb_->time_s();
            take(parser_.report());
          }
      });
    } else if (status != UsbStatus::idle) {
      ++counters_.transfer_errors;
      parser_.reset();
    }
    if (status == UsbStatus::gone || usb_->gone() || !in_->submit(kInBytes)) {
      fail();
      return any;
    }
  }
  if (usb_->gone()) fail();
  return any;
}

void Falcon::take(const FalconReport& report) noexcept {
  if (state_.status != DeviceStatus::homing && state_.status != DeviceStatus::ready) return;
  state_.buttons = report.buttons;
  if (!report.allHomed()) {
    state_.status = DeviceStatus::homing;
    state_.p_D.setZero();
    state_.v_D.setZero();
    report_s_ = usb_->time_s();
    state_.time_s = report_s_ - opened_s_;
    return;
  }
  const Eigen::Vector3d angles_rad = falconAnglesOfCounts(report.counts);
  const bool ready = state_.status == DeviceStatus::ready;
  FalconPlace place = falconPlace(angles_rad, ready ? p_F_ : kFalconCentre_F);
  if (!place.reached) place = falconPlace(angles_rad, kFalconCentre_F);
  if (!place.reached || (place.p_F - kFalconCentre_F).cwiseAbs().maxCoeff() > kFarthest_m) {
    ++counters_.refused_reports;
    refused_in_a_row_ = 0;
    return;
  }
  if (!ready) {
    begin(place.p_F);
    return;
  }
  const double interval_s = std::clamp(usb_->time_s() - report_s_, kLeastInterval_s, kMostInterval_s);
  if ((place.p_F - p_F_).norm() <= kMostSpeed_m_s * interval_s) {
    refused_in_a_row_ = 0;
    moveTo(place.p_F);
    return;
  }
  ++counters_.refused_reports;
  const bool agrees = (place.p_F - refused_F_).norm() <= kMostSpeed_m_s * kLeastInterval_s;
  refused_in_a_row_ = refused_in_a_row_ > 0 && agrees ? refused_in_a_row_ + 1 : 1;
  refused_F_ = place.p_F;
  if (refused_in_a_row_ >= kBelieved) begin(place.p_F);
}

// Accepts a position unrelated to the last one: the velocity is zero and the force restarts from zero.
void Falcon::begin(const Eigen::Vector3d& p_F) noexcept {
  state_.status = DeviceStatus::ready;
  gate_.close(usb_->time_s());
  refused_in_a_row_ = 0;
  held_ = 0;
  moveTo(p_F);
}

void Falcon::moveTo(const Eigen::Vector3d& p_F) noexcept {
  p_F_ = p_F;
  report_s_ = usb_->time_s();
  state_.time_s = report_s_ - opened_s_;
  state_.p_D = p_F - kFalconCentre_F;
  newest_ = (newest_ + 1) % samples_.size();
  samples_[newest_] = {report_s_, state_.p_D};
  held_ = std::min(held_ + 1, samples_.size());
  std::size_t back = 0;
  const auto sample = [this](std::size_t ago) -> const Sample& {
    return samples_[(newest_ + samples_.size() - ago) % samples_.size()];
  };
  while (back + 1 < held_ && report_s_ - sample(back).time_s < kVelocityWindow_s) ++back;
  const double window_s = report_s_ - sample(back).time_s;
  if (window_s >= kLeastWindow_s)
    state_.v_D = (state_.p_D - sample(back).p_D) / window_s;
  else
    state_.v_D.setZero();
}

// Sends the first zero whatever the time, if the device has taken the command before.
void Falcon::sendZeros(const FalconCommand& zero, double until_s) noexcept {
  const FalconPacket packet = packFalconCommand(zero);
  const auto left_s = [&] { return std::max(0.0, until_s - usb_->time_s()); };
  for (int i = 0; i < kZeroPackets && !usb_->gone() && (i == 0 || left_s() > 0); ++i) {
    if (!out_->cancel(left_s())) break;
    if (i == 0 && out_->status() == UsbStatus::done) taken_N_ = sent_N_;
    std::copy(packet.begin(), packet.end(), out_->buffer().begin());
    // Half of the remaining time for the transfer, half for the system to return the buffer.
    const double wait_s = std::min(kZeroTime_s, 0.5 * left_s());
    if (usb_->run(*out_, packet.size(), wait_s, wait_s) == UsbStatus::done) taken_N_.setZero();
  }
  sent_N_ = taken_N_;
}

void Falcon::fail() noexcept {
  if (state_.status == DeviceStatus::fault || state_.status == DeviceStatus::booting) return;
  state_.status = DeviceStatus::fault;
  state_.v_D.setZero();
  sendZeros({.red = true}, deadline_s_);
  state_.sent_N = sent_N_;
  in_->cancel(std::max(0.0, deadline_s_ - usb_->time_s()));
}

}  // namespace filiform
