#include "device/bridge/bridge_device.h"

#include "device/bridge/bridge_folder.h"
#include "device/bridge/bridge_protocol.h"
#include "device/bridge/internal/bridge_socket.h"
#include "device/device_gate.h"

#include <algorithm>
#include <array>
#include <atomic>
#include <cerrno>
#include <cmath>
#include <cstdlib>
#include <cstring>
#include <ctime>
#include <poll.h>
#include <sys/socket.h>
#include <unistd.h>

namespace filiform {

namespace {

using internal::OwnedDescriptor;

constexpr int kMostPackets = 64;              // packets an exchange: a flood cannot block it
constexpr double kMost_m = 10;                // positions beyond are not believable
constexpr double kAssumedDamping_Ns_m = 0.5;  // of device and hand together, at least, if the device's is unknown

std::int64_t monotonic_ns() noexcept {
  timespec now{};
  ::clock_gettime(CLOCK_MONOTONIC, &now);
  return std::int64_t{now.tv_sec} * 1'000'000'000 + now.tv_nsec;
}

std::int64_t inNanoseconds(double seconds) noexcept { return static_cast<std::int64_t>(1e9 * seconds); }

// Throws if a description of a device cannot be right.
DeviceCapabilities capabilitiesOf(const fb_hello& hello, const std::string& where) {
  const auto require = [&where](bool kept, const char* what) {
    if (!kept) throw DeviceError(where + ": the bridge describes its device wrongly: " + what);
  };
  const double numbers[] = {hello.peak_force_N, hello.continuous_force_N, hello.max_stiffness_N_m,
                            hello.damping_Ns_m, hello.resolution_m,       hello.rate_Hz};
  for (const double number : numbers) require(number >= 0 && number <= 1e6, "a limit is negative, or not a number");
  require(hello.peak_force_N > 0 && hello.peak_force_N <= 1000, "the peak force must be 0 to 1000 N");
  require(hello.rate_Hz >= 10, "the rate must be at least 10 Hz");
  require(hello.buttons <= 32, "more than 32 buttons");
  for (int i = 0; i < 3; ++i)
    require(hello.lo_D[i] >= -kMost_m && hello.hi_D[i] <= kMost_m && hello.hi_D[i] - hello.lo_D[i] >= 1e-3,
            "the workspace must be at least 1 mm wide, and within 10 m");
  DeviceCapabilities can;
  for (const char* c = hello.name; *c != 0; ++c) can.name += *c >= 0x20 && *c < 0x7f ? *c : '?';
  std::copy_n(hello.lo_D, 3, can.workspace_lo_D.data());
  std::copy_n(hello.hi_D, 3, can.workspace_hi_D.data());
  can.peak_force_N = hello.peak_force_N;
  can.continuous_force_N = hello.continuous_force_N;
  can.max_stiffness_N_m = hello.max_stiffness_N_m;
  can.damping_Ns_m = hello.damping_Ns_m;
  can.resolution_m = hello.resolution_m;
  can.nominal_rate_Hz = hello.rate_Hz;
  can.buttons = static_cast<int>(hello.buttons);
  can.keeps_time = true;
  can.renders_model = true;
  can.is_led = (hello.flags & FB_IS_LED) != 0;
  can.senses_orientation = (hello.flags & FB_KNOWS_ORIENTATION) != 0;
  can.paces_loop = (hello.flags & FB_PACES) != 0;
  can.needs_homing = (hello.flags & FB_HOMES) != 0;
  can.delay_samples = static_cast<int>(hello.flags >> FB_DELAY_SHIFT & 15);
  return can;
}

}  // namespace

struct BridgeDevice::Impl {
  static constexpr std::size_t kMostAdvice = 16;

  BridgeOptions options;
  std::string where;
  bool udp = false;
  OwnedDescriptor socket;
  std::array<unsigned char, FB_COOKIE_BYTES> cookie{};
  DeviceCapabilities capabilities;
  DeviceState state;
  Eigen::Vector3d aim_D = Eigen::Vector3d::Zero();
  BridgeCounters counters;
  double typical_s = 0, longest_s = 0;
  std::uint32_t seq = 0, taken = 0;  // of the last packet sent; of the newest STATE
  std::uint32_t flags = 0;           // of the newest STATE
  std::int64_t began_ns = 0;         // the first STATE's time
  std::int64_t heard_ns = 0;
  std::int64_t asked_ns = 0;  // of the first COMMAND since the newest STATE; 0: none
  // Different texts so far. Readers on other threads hold pointers to them, so none is changed.
  std::array<std::array<char, FB_TEXT_BYTES>, kMostAdvice> advices{};
  std::size_t advice_count = 0;
  std::atomic<const char*> advice{""};
  bool is_open = false, has_state = false, is_gone = false, has_servo = false, silent = false;

  bool send(fb_packet& packet) noexcept {
    unsigned char bytes[FB_COOKIE_BYTES + FB_MOST_BYTES];
    packet.seq = ++seq;
    const std::size_t size = fb_encode(&packet, bytes + FB_COOKIE_BYTES);
    std::copy(cookie.begin(), cookie.end(), bytes);
    const std::size_t skipped = udp ? 0 : FB_COOKIE_BYTES;
    const ssize_t sent =
        ::send(socket.number, bytes + skipped, size + FB_COOKIE_BYTES - skipped, MSG_NOSIGNAL | MSG_DONTWAIT);
    // A full queue loses the packet: the bridge is stopped, and forces that wait in its queue would be old.
    if (sent < 0 && errno != EAGAIN && errno != EINTR && errno != ENOBUFS) is_gone = true;
    return sent >= 0;
  }

  // Reads one packet. False: none is there.
  bool receive(fb_packet& packet, bool& is_valid) noexcept {
    unsigned char bytes[FB_COOKIE_BYTES + FB_MOST_BYTES + 1];
    ssize_t size = ::recv(socket.number, bytes, sizeof bytes, MSG_DONTWAIT);
    // A bridge that refuses closes with the CALL unread. The system reports that first, then the REFUSE.
    if (size < 0 && errno == ECONNRESET) size = ::recv(socket.number, bytes, sizeof bytes, MSG_DONTWAIT);
    is_valid = false;
    if (size <= 0) {
      if (size == 0 || (errno != EAGAIN && errno != EINTR)) is_gone = true;
      return false;
    }
    const std::size_t skipped = udp ? FB_COOKIE_BYTES : 0;
    const auto bytes_of = static_cast<std::size_t>(size);
    is_valid = bytes_of >= skipped && std::equal(bytes, bytes + skipped, cookie.begin()) &&
               fb_decode(bytes + skipped, bytes_of - skipped, &packet) != 0;
    if (!is_valid) ++counters.strange;
    return true;
  }

  bool waitUntil(std::int64_t time_ns) noexcept {
    const std::int64_t left_ns = std::max<std::int64_t>(0, time_ns - monotonic_ns());
    const timespec wait{left_ns / 1'000'000'000, static_cast<long>(left_ns % 1'000'000'000)};
    pollfd ready{socket.number, POLLIN, 0};
    return ::ppoll(&ready, 1, &wait, nullptr) > 0;
  }

  // Takes a STATE if it is newer than the last one, and finite.
  bool take(const fb_packet& packet) noexcept {
    if (packet.kind == FB_ADVICE) takeAdvice(packet.is.text);
    if (packet.kind == FB_ADVICE) return false;
    const fb_state& s = packet.is.state;
    const bool is_newer = !has_state || static_cast<std::int32_t>(packet.seq - taken) > 0;
    const bool is_sane = fb_finite(s.p_D, 3) && fb_finite(s.v_D, 3) && fb_finite(s.force_N, 3) &&
                         fb_finite(s.orientation, 4) && std::abs(s.p_D[0]) <= kMost_m &&
                         std::abs(s.p_D[1]) <= kMost_m && std::abs(s.p_D[2]) <= kMost_m;
    if (packet.kind != FB_STATE || !is_newer || !is_sane) {
      ++counters.strange;
      return false;
    }
    if (!has_state) began_ns = s.time_ns;
    has_state = true;
    taken = packet.seq;
    flags = s.flags;
    heard_ns = monotonic_ns();
    asked_ns = 0;
    ++counters.states;
    counters.refused = s.refused;
    // The subtraction may wrap for any bytes; the conversion is defined.
    state.time_s = 1e-9 * static_cast<double>(static_cast<std::int64_t>(static_cast<std::uint64_t>(s.time_ns) -
                                                                        static_cast<std::uint64_t>(began_ns)));
    std::copy_n(s.p_D, 3, state.p_D.data());
    std::copy_n(s.v_D, 3, state.v_D.data());
    state.buttons = s.buttons;
    Eigen::Vector3d sent_N;
    std::copy_n(s.force_N, 3, sent_N.data());
    state.sent_N = sent_N;
    if (capabilities.senses_orientation) takeOrientation(s);
    return true;
  }

  void takeAdvice(const char* text) noexcept {
    std::array<char, FB_TEXT_BYTES> said{};
    for (std::size_t i = 0; i + 1 < said.size() && text[i] != '\0'; ++i)
      said[i] = static_cast<unsigned char>(text[i]) < 0x20 || text[i] == 0x7f ? '?' : text[i];
    const auto end = advices.begin() + static_cast<std::ptrdiff_t>(advice_count);
    const auto at = std::find(advices.begin(), end, said);
    if (at == end && advice_count == kMostAdvice) return;
    if (at == end) {
      *at = said;
      ++advice_count;
    }
    advice.store(at->data(), std::memory_order_release);
  }

  // An orientation that is no rotation is ignored: the last one stays.
  void takeOrientation(const fb_state& s) noexcept {
    Orientation read;
    std::copy_n(s.orientation, 4, read.coeffs().data());
    const double length = read.norm();
    if (!(std::abs(length - 1) <= 0.1))
      ++counters.strange;
    else
      state.orientation_D.coeffs() = read.coeffs() / length;
  }

  // What a bridge said before it ended.
  void hearLast() noexcept {
    bool is_valid = false;
    fb_packet packet{};
    for (int i = 0; i < kMostPackets && receive(packet, is_valid); ++i)
      if (is_valid) take(packet);
  }

  // Sends a COMMAND and waits for its STATE. False: it did not come.
  bool command(const Eigen::Vector3d& force_N, const LocalModel& model, bool arm) noexcept {
    fb_packet packet{};
    packet.kind = FB_COMMAND;
    fb_command& c = packet.is.command;
    c.flags = static_cast<std::uint32_t>((arm ? FB_ARM : 0) | (capabilities.is_led ? FB_AIM : 0));
    c.ttl_us = static_cast<std::uint32_t>(std::min(1e6 * model.time_to_live_s, double{FB_TTL_US}));
    c.time_ns = monotonic_ns();
    std::copy_n(force_N.data(), 3, c.force_N);
    std::copy_n(model.at_D.data(), 3, c.at_D);
    Eigen::Matrix3d k = model.stiffness_N_m;
    const double stiffest = k.cwiseAbs().rowwise().sum().maxCoeff();  // no eigenvalue is greater
    if (capabilities.max_stiffness_N_m > 0 && stiffest > capabilities.max_stiffness_N_m)
      k *= capabilities.max_stiffness_N_m / stiffest;
    const double six[] = {k(0, 0), k(0, 1), k(0, 2), k(1, 1), k(1, 2), k(2, 2)};
    std::copy_n(six, 6, c.stiffness_N_m);
    c.damping_Ns_m = model.damping_Ns_m;
    c.radius_m = model.radius_m;
    std::copy_n(aim_D.data(), 3, c.aim_D);
    if (asked_ns == 0) asked_ns = c.time_ns;
    if (!send(packet)) {
      if (is_gone) hearLast();
      return false;
    }
    ++counters.commands;
    const std::uint32_t mine = seq;
    const std::int64_t deadline_ns = c.time_ns + inNanoseconds(options.answer_s);
    bool answered = false;
    for (int i = 0; i < kMostPackets && !answered && !is_gone && waitUntil(deadline_ns); ++i) {
      fb_packet received{};
      bool is_valid = false;
      if (!receive(received, is_valid)) continue;
      answered = is_valid && take(received) && received.is.state.answers == mine;
    }
    counters.unanswered += !answered;
    return answered;
  }

  void connect() {
    udp = options.address.starts_with("udp:");
    where = "bridge:" + options.address;
    socket = OwnedDescriptor();
    if (options.connect) {
      where = options.address;
      socket = OwnedDescriptor(options.connect());
    } else if (udp) {
      socket = internal::connectToPort(options.address);  // complains of the address first
      cookie = internal::readCookie(options.cookie_file.empty() ? bridgeCookieFile() : options.cookie_file);
    } else {
      const std::string path = options.address.empty() ? onlyBridge() : options.address;
      where = "bridge:" + path;
      socket = internal::connectToPath(path);
    }
    is_gone = has_state = false;
    seq = 0;
    asked_ns = 0;
    const fb_hello hello = call();
    capabilities = capabilitiesOf(hello, where);
    has_servo = (hello.flags & FB_OWN_SERVO) != 0;
    if (!options.connect) capabilities.name += " (bridge)";
    measure();
  }

  fb_hello call() {
    const std::int64_t deadline_ns = monotonic_ns() + inNanoseconds(options.connect_s);
    fb_packet packet{};
    packet.kind = FB_CALL;
    send(packet);
    is_gone = false;  // a bridge that refuses closes at once; its REFUSE can still be read
    for (std::int64_t resent_ns = monotonic_ns(); !is_gone && monotonic_ns() < deadline_ns;) {
      if (udp && monotonic_ns() - resent_ns > 100'000'000) {  // datagrams may be lost
        packet.kind = FB_CALL;
        send(packet);
        resent_ns = monotonic_ns();
      }
      if (!waitUntil(std::min(deadline_ns, resent_ns + 101'000'000))) continue;
      fb_packet received{};
      bool is_valid = false;
      if (!receive(received, is_valid) || !is_valid) continue;
      if (received.kind == FB_HELLO) return received.is.hello;
      if (received.kind == FB_REFUSE)
        throw DeviceError(where + (received.is.reason == FB_OTHER_MASTER
                                       ? ": the bridge serves another program; close that first"
                                   : received.is.reason == FB_OTHER_USER ? ": the bridge belongs to another user"
                                                                         : ": the bridge has another version"));
    }
    throw DeviceError(where + ": the bridge does not answer; see whether it runs" +
                      (udp ? " and has the same cookie file" : "") + ", and start it again");
  }

  // Round trips of commands without ARM: they render nothing.
  void measure() {
    std::vector<double> times_s, ages_s;
    for (int i = 0; i < std::max(1, options.round_trips); ++i) {
      const std::int64_t from_ns = monotonic_ns();
      if (command(Eigen::Vector3d::Zero(), {}, false)) {
        times_s.push_back(1e-9 * static_cast<double>(monotonic_ns() - from_ns));
        ages_s.push_back(1e-9 * static_cast<double>(heard_ns - began_ns) - state.time_s);
      }
      if (is_gone) break;
    }
    if (times_s.empty()) throw DeviceError(where + ": the bridge does not answer commands; start it again");
    std::sort(times_s.begin(), times_s.end());
    typical_s = times_s[times_s.size() / 2];
    longest_s = times_s.back();
    // A force that is computed from a state goes out with the next exchange: one period, or more if the transport is
    // slower than that.
    const std::size_t late = times_s.size() * 9 / 10;
    const double late_s = times_s[late];
    if (capabilities.paces_loop) {  // a round trip contains the wait for the sample, which is the period itself
      std::sort(ages_s.begin(), ages_s.end());
      lowerFor(std::clamp(2 * ages_s[late], 0.0, options.answer_s));
      return;
    }
    const double servo_s = has_servo ? 1 / capabilities.nominal_rate_Hz : 0;
    const auto periods = [this](double time_s) { return std::ceil(time_s / options.period_s - 1e-9); };
    capabilities.delay_samples = static_cast<int>(std::min(8.0, std::max(1.0, periods(late_s)) + periods(servo_s)));
  }

  // The process between driver and program makes each period `hop_s` longer: lowers the device's limit of stiffness as
  // solver/FORCES.md says.
  void lowerFor(double hop_s) noexcept {
    DeviceCapabilities& can = capabilities;
    can.delay_samples = std::max(1, can.delay_samples);
    const double periods = 0.5 + can.delay_samples, most_N_m = can.max_stiffness_N_m;
    const double damping_Ns_m = can.damping_Ns_m > 0 ? can.damping_Ns_m : kAssumedDamping_Ns_m;
    can.max_stiffness_N_m /= 1 + most_N_m * hop_s * periods / damping_Ns_m;
    if (can.damping_Ns_m <= 0) return;
    const double bound_N_m = 0.8 * can.damping_Ns_m / (periods * (options.period_s + hop_s));
    can.max_stiffness_N_m = most_N_m > 0 ? std::min(can.max_stiffness_N_m, bound_N_m) : bound_N_m;
  }

  void updateStatus() noexcept {
    // Silence counts from a command, so that a program that was stopped does not lose its device.
    silent = asked_ns > 0 && monotonic_ns() - asked_ns > inNanoseconds(options.silence_s);
    silent = silent && !is_gone && (flags & FB_FAULT) == 0;
    if (is_gone || silent || (flags & FB_FAULT) != 0)
      state.status = DeviceStatus::fault;
    else
      state.status = (flags & FB_READY) != 0 ? DeviceStatus::ready : DeviceStatus::homing;
    if (state.status == DeviceStatus::fault) state.sent_N = Eigen::Vector3d::Zero();
  }
};

BridgeDevice::BridgeDevice(const BridgeOptions& options) : impl_(std::make_unique<Impl>()) {
  for (const double time_s : {options.period_s, options.answer_s, options.silence_s, options.connect_s})
    if (!(time_s > 0 && time_s <= 1e3)) throw DeviceError("bridge: times must be greater than 0, and at most 1000 s");
  impl_->options = options;
  impl_->connect();
}

BridgeDevice::~BridgeDevice() { close(); }

const DeviceCapabilities& BridgeDevice::capabilities() const { return impl_->capabilities; }

DeviceStatus BridgeDevice::status() const noexcept { return impl_->state.status; }

void BridgeDevice::open() {
  Impl& d = *impl_;
  if (d.is_open && d.state.status != DeviceStatus::fault) return;
  if (d.socket.number < 0 || d.is_gone || d.state.status == DeviceStatus::fault) d.connect();
  d.state = DeviceState();
  d.has_state = false;
  d.asked_ns = 0;
  d.is_open = true;
  d.command(Eigen::Vector3d::Zero(), {}, true);
  d.updateStatus();
}

void BridgeDevice::close() noexcept {
  Impl& d = *impl_;
  if (d.socket.number >= 0 && !d.is_gone) {
    if (d.is_open) d.command(Eigen::Vector3d::Zero(), {}, false);
    fb_packet packet{};
    packet.kind = FB_BYE;
    d.send(packet);
  }
  d.socket = OwnedDescriptor();
  d.is_open = false;
  d.state.status = DeviceStatus::closed;
}

DeviceState BridgeDevice::exchange(const Wrench& wrench) noexcept {
  Impl& d = *impl_;
  if (!d.is_open || d.state.status == DeviceStatus::fault) return d.state;
  const bool is_ready = d.state.status == DeviceStatus::ready;
  Wrench sent = is_ready ? finiteOrZero(wrench) : Wrench{};
  DeviceGate::shorten(sent, d.capabilities.peak_force_N);
  d.command(sent.force_N, sent.model, is_ready && (d.flags & FB_ARMED) == 0);
  d.updateStatus();
  return d.state;
}

void BridgeDevice::lead(const Eigen::Vector3d& target_D) noexcept {
  if (target_D.allFinite()) impl_->aim_D = target_D;
}

const char* BridgeDevice::advice() const noexcept { return impl_->advice.load(std::memory_order_acquire); }

double BridgeDevice::typicalRoundTrip_s() const noexcept { return impl_->typical_s; }

double BridgeDevice::longestRoundTrip_s() const noexcept { return impl_->longest_s; }

BridgeCounters BridgeDevice::counters() const noexcept { return impl_->counters; }

bool BridgeDevice::isSilent() const noexcept { return impl_->silent; }

}  // namespace filiform
