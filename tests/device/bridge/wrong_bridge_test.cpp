// filiform's side against a bridge that answers wrongly.
#include "device/bridge/bridge_device.h"
#include "device/bridge/bridge_protocol.h"
#include "tests/support/devices/bridge_process.h"
#include "tests/support/temp_folder.h"

#include <algorithm>
#include <atomic>
#include <cmath>
#include <functional>
#include <stdexcept>
#include <string>
#include <sys/socket.h>
#include <sys/un.h>
#include <thread>
#include <unistd.h>

#include <gtest/gtest.h>

namespace filiform {
namespace {

using test::refusalOf;

// A bridge in a thread of this process, which answers as the test wants.
class MadeUpBridge {
 public:
  using Answer = std::function<void(const fb_packet& to, int socket)>;
  MadeUpBridge(const std::string& path, Answer answer) : answer_(std::move(answer)) {
    sockaddr_un address{};
    address.sun_family = AF_UNIX;
    std::copy(path.begin(), path.end(), address.sun_path);
    listener_ = ::socket(AF_UNIX, SOCK_SEQPACKET | SOCK_CLOEXEC, 0);
    if (::bind(listener_, reinterpret_cast<const sockaddr*>(&address), sizeof address) != 0 ||
        ::listen(listener_, 1) != 0)
      throw std::runtime_error("cannot listen");
    thread_ = std::thread([this] { run(); });
  }
  ~MadeUpBridge() {
    ::shutdown(listener_, SHUT_RDWR);
    if (const int master = master_; master >= 0) ::shutdown(master, SHUT_RDWR);
    thread_.join();
    ::close(listener_);
  }
  static void send(int socket, const fb_packet& packet) {
    unsigned char bytes[FB_MOST_BYTES];
    const std::size_t size = fb_encode(&packet, bytes);
    static_cast<void>(::send(socket, bytes, size, MSG_NOSIGNAL));
  }
  static fb_packet hello() {
    fb_packet packet{};
    packet.kind = FB_HELLO;
    packet.seq = 1;
    fb_hello& h = packet.is.hello;
    for (int i = 0; i < 3; ++i) h.lo_D[i] = -(h.hi_D[i] = 0.05);
    h.peak_force_N = 5;
    h.rate_Hz = 1000;
    return packet;
  }

 private:
  void run() {
    const int master = ::accept4(listener_, nullptr, nullptr, SOCK_CLOEXEC);
    if (master < 0) return;
    master_ = master;
    unsigned char bytes[FB_MOST_BYTES + 1];
    for (ssize_t size = 0; (size = ::recv(master, bytes, sizeof bytes, 0)) > 0;) {
      fb_packet packet{};
      if (fb_decode(bytes, static_cast<std::size_t>(size), &packet) != 0) answer_(packet, master);
    }
    master_ = -1;
    ::close(master);
  }
  Answer answer_;
  int listener_ = -1;
  std::atomic<int> master_{-1};
  std::thread thread_;
};

fb_packet stateFor(const fb_packet& command, std::uint32_t seq) {
  fb_packet packet{};
  packet.kind = FB_STATE;
  packet.seq = seq;
  packet.is.state.answers = command.seq;
  packet.is.state.flags = FB_READY | FB_ARMED;
  packet.is.state.time_ns = 1'000'000LL * seq;
  packet.is.state.p_D[0] = 1e-6 * seq;
  return packet;
}

TEST(WrongBridge, IgnoresStatesThatAreOldOrNotFinite) {
  const test::TempFolder folder;
  std::atomic<int> trouble{0};
  std::uint32_t seq = 1;
  MadeUpBridge bridge(folder / "b", [&](const fb_packet& to, int socket) {
    if (to.kind == FB_CALL) MadeUpBridge::send(socket, MadeUpBridge::hello());
    if (to.kind != FB_COMMAND) return;
    if (trouble == 1) {  // a packet with NaN, an old one, one of another kind, bytes that are none
      fb_packet wrong = stateFor(to, ++seq);
      wrong.is.state.v_D[1] = NAN;
      MadeUpBridge::send(socket, wrong);
      MadeUpBridge::send(socket, stateFor(to, 2));
      MadeUpBridge::send(socket, MadeUpBridge::hello());
      static_cast<void>(::send(socket, "no packet", 9, MSG_NOSIGNAL));
      wrong = stateFor(to, ++seq);
      wrong.is.state.p_D[2] = 1e9;
      MadeUpBridge::send(socket, wrong);
    }
    if (trouble < 2) MadeUpBridge::send(socket, stateFor(to, ++seq));
  });
  BridgeDevice device({.address = folder / "b", .answer_s = 5, .silence_s = 100});
  device.open();
  const DeviceState before = device.exchange({});
  EXPECT_EQ(before.status, DeviceStatus::ready);
  EXPECT_EQ(device.counters().strange, 0U);
  trouble = 1;
  const DeviceState during = device.exchange({});
  EXPECT_EQ(device.counters().strange, 5U);
  EXPECT_TRUE(during.v_D.isZero());
  EXPECT_GT(during.p_D.x(), before.p_D.x()) << "the good one among them counts";
  EXPECT_LT(during.p_D.norm(), 1);
  trouble = 0;
  EXPECT_EQ(device.exchange({}).status, DeviceStatus::ready);
}

TEST(WrongBridge, IgnoresOrientationsThatAreNoRotation) {
  const test::TempFolder folder;
  std::atomic<int> turn{0};
  std::uint32_t seq = 1;
  const double turns[][4] = {{0, 0, 0, 1}, {0.6, 0, 0, 0.8}, {0, 0, 0, 0}, {3, 0, 0, 4}, {0, 0.61, 0, 0.79}};
  MadeUpBridge bridge(folder / "b", [&](const fb_packet& to, int socket) {
    fb_packet hello = MadeUpBridge::hello();
    hello.is.hello.flags = FB_KNOWS_ORIENTATION;
    if (to.kind == FB_CALL) MadeUpBridge::send(socket, hello);
    if (to.kind != FB_COMMAND) return;
    fb_packet state = stateFor(to, ++seq);
    std::copy_n(turns[turn], 4, state.is.state.orientation);
    MadeUpBridge::send(socket, state);
  });
  BridgeDevice device({.address = folder / "b", .answer_s = 5, .silence_s = 100});
  EXPECT_TRUE(device.capabilities().senses_orientation);
  device.open();
  EXPECT_EQ(device.exchange({}).orientation_D.coeffs(), Eigen::Vector4d(0, 0, 0, 1));
  turn = 1;
  const Eigen::Vector4d turned(0.6, 0, 0, 0.8);
  EXPECT_LT((device.exchange({}).orientation_D.coeffs() - turned).norm(), 1e-12);
  for (const int wrong : {2, 3}) {
    turn = wrong;
    EXPECT_LT((device.exchange({}).orientation_D.coeffs() - turned).norm(), 1e-12) << "the last one stays";
  }
  EXPECT_EQ(device.counters().strange, 2U);
  turn = 4;
  EXPECT_NEAR(device.exchange({}).orientation_D.coeffs().norm(), 1, 1e-12);
}

TEST(WrongBridge, RefusesADescriptionThatCannotBeRight) {
  const std::pair<const char*, std::function<void(fb_hello&)>> wrongs[] = {
      {"peak", [](fb_hello& h) { h.peak_force_N = 0; }},
      {"peak NaN", [](fb_hello& h) { h.peak_force_N = NAN; }},
      {"rate", [](fb_hello& h) { h.rate_Hz = 0; }},
      {"stiffness", [](fb_hello& h) { h.max_stiffness_N_m = -1; }},
      {"damping", [](fb_hello& h) { h.damping_Ns_m = INFINITY; }},
      {"workspace", [](fb_hello& h) { h.lo_D[1] = h.hi_D[1]; }},
      {"workspace NaN", [](fb_hello& h) { h.hi_D[2] = NAN; }},
      {"buttons", [](fb_hello& h) { h.buttons = 33; }},
  };
  for (const auto& [name, spoil] : wrongs) {
    const test::TempFolder folder;
    fb_packet hello = MadeUpBridge::hello();
    spoil(hello.is.hello);
    MadeUpBridge bridge(folder / "b", [&](const fb_packet&, int socket) { MadeUpBridge::send(socket, hello); });
    EXPECT_NE(refusalOf({.address = folder / "b"}).find("describes its device wrongly"), std::string::npos) << name;
  }
}

TEST(WrongBridge, SaysWhatIsMissing) {
  const test::TempFolder folder;
  EXPECT_NE(refusalOf({.address = folder / "none"}).find("no bridge listens there"), std::string::npos);
  EXPECT_NE(refusalOf({.address = std::string(200, 'x')}).find("too long"), std::string::npos);
  MadeUpBridge silent(folder / "b", [](const fb_packet&, int) {});
  EXPECT_NE(refusalOf({.address = folder / "b", .connect_s = 0.1}).find("does not answer"), std::string::npos);
}

}  // namespace
}  // namespace filiform
