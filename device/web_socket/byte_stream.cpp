#include "device/web_socket/byte_stream.h"

#include "device/haptic_device.h"

#include <algorithm>
#include <cerrno>
#include <cmath>
#include <cstring>
#include <netdb.h>
#include <netinet/in.h>
#include <netinet/tcp.h>
#include <poll.h>
#include <sys/socket.h>
#include <time.h>
#include <unistd.h>
#include <utility>

namespace filiform {
namespace {

constexpr double kAsked_s = 0.01;  // how often is_abandoned is asked

double now_s() noexcept {
  timespec t{};
  clock_gettime(CLOCK_MONOTONIC, &t);
  return static_cast<double>(t.tv_sec) + 1e-9 * static_cast<double>(t.tv_nsec);
}

timespec timeOf(double seconds) noexcept {
  const double positive_s = std::clamp(seconds, 0.0, 1e9);
  timespec t{};
  t.tv_sec = static_cast<time_t>(positive_s);
  t.tv_nsec = std::min(999'999'999L, static_cast<long>(1e9 * (positive_s - std::floor(positive_s))));
  return t;
}

// False at the end of the time, or if the wait is abandoned.
bool await(int descriptor, short events, double until_s, const std::function<bool()>& is_abandoned) noexcept {
  for (;;) {
    const double left_s = until_s - now_s();
    if (left_s <= 0 || (is_abandoned && is_abandoned())) return false;
    const timespec wait = timeOf(is_abandoned ? std::min(left_s, kAsked_s) : left_s);
    pollfd wanted{descriptor, events, 0};
    const int ready = ::ppoll(&wanted, 1, &wait, nullptr);
    if (ready > 0) return true;
    if (ready < 0 && errno != EINTR) return false;
  }
}

class TcpStream : public ByteStream {
 public:
  TcpStream(int descriptor, std::function<bool()> is_abandoned)
      : descriptor_(descriptor), is_abandoned_(std::move(is_abandoned)) {}
  ~TcpStream() override { ::close(descriptor_); }
  TcpStream(const TcpStream&) = delete;
  TcpStream& operator=(const TcpStream&) = delete;

  // Returns 0, or the error.
  int connect(const addrinfo& address, double until_s) noexcept {
    if (::connect(descriptor_, address.ai_addr, address.ai_addrlen) == 0) return 0;
    if (errno != EINPROGRESS) return errno;
    if (!await(descriptor_, POLLOUT, until_s, is_abandoned_)) return ETIMEDOUT;
    int error = 0;
    socklen_t size = sizeof error;
    return getsockopt(descriptor_, SOL_SOCKET, SO_ERROR, &error, &size) == 0 ? error : errno;
  }

  bool write(std::span<const char> bytes, double wait_s) noexcept override {
    const double until_s = now_s() + wait_s;
    while (!bytes.empty()) {
      const ssize_t sent = ::send(descriptor_, bytes.data(), bytes.size(), MSG_NOSIGNAL | MSG_DONTWAIT);
      if (sent > 0)
        bytes = bytes.subspan(static_cast<std::size_t>(sent));
      else if (errno != EINTR && (errno != EAGAIN || !await(descriptor_, POLLOUT, until_s, is_abandoned_)))
        return false;
    }
    return true;
  }

  long read(std::span<char> into, double wait_s) noexcept override {
    const double until_s = now_s() + wait_s;
    for (;;) {
      const ssize_t got = ::recv(descriptor_, into.data(), into.size(), MSG_DONTWAIT);
      if (got > 0) return got;
      if (got == 0) return into.empty() ? 0 : -1;
      if (errno == EINTR) continue;
      if (errno != EAGAIN) return -1;
      if (!await(descriptor_, POLLIN, until_s, is_abandoned_)) return 0;
    }
  }

  void sleepUntil(double until_s) noexcept override {
    const timespec until = timeOf(until_s);
    while (clock_nanosleep(CLOCK_MONOTONIC, TIMER_ABSTIME, &until, nullptr) == EINTR) {
    }
  }

  double time_s() const noexcept override { return now_s(); }

 private:
  const int descriptor_;
  const std::function<bool()> is_abandoned_;
};

}  // namespace

std::unique_ptr<ByteStream> connectTcp(const std::string& host, std::uint16_t port, const TcpOptions& options) {
  addrinfo hints{};
  hints.ai_socktype = SOCK_STREAM;
  addrinfo* found = nullptr;
  if (const int error = getaddrinfo(host.c_str(), std::to_string(port).c_str(), &hints, &found); error != 0)
    throw DeviceError(gai_strerror(error));
  const std::unique_ptr<addrinfo, void (*)(addrinfo*)> addresses(found, freeaddrinfo);
  const double until_s = now_s() + options.timeout_s;
  int error = 0;
  for (const addrinfo* address = found; address != nullptr; address = address->ai_next) {
    const int descriptor = ::socket(address->ai_family, address->ai_socktype | SOCK_CLOEXEC | SOCK_NONBLOCK, 0);
    if (descriptor < 0) {
      error = errno;
      continue;
    }
    auto stream = std::make_unique<TcpStream>(descriptor, options.is_abandoned);
    const int on = 1;
    setsockopt(descriptor, IPPROTO_TCP, TCP_NODELAY, &on, sizeof on);
    if (options.receive_bytes > 0)
      setsockopt(descriptor, SOL_SOCKET, SO_RCVBUF, &options.receive_bytes, sizeof options.receive_bytes);
    error = stream->connect(*address, until_s);
    if (error == 0) return stream;
  }
  throw DeviceError(std::strerror(error));
}

}  // namespace filiform
