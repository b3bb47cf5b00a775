#include "device/haply/byte_stream.h"

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

namespace filiform {
namespace {

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

class TcpStream : public ByteStream {
 public:
  explicit TcpStream(int descriptor) : descriptor_(descriptor) {
    const int on = 1;
    setsockopt(descriptor_, IPPROTO_TCP, TCP_NODELAY, &on, sizeof on);
  }
  ~TcpStream() override { ::close(descriptor_); }
  TcpStream(const TcpStream&) = delete;
  TcpStream& operator=(const TcpStream&) = delete;

  bool write(std::span<const char> bytes, double wait_s) noexcept override {
    const double until_s = now_s() + wait_s;
    while (!bytes.empty()) {
      const ssize_t sent = ::send(descriptor_, bytes.data(), bytes.size(), MSG_NOSIGNAL | MSG_DONTWAIT);
      if (sent > 0)
        bytes = bytes.subspan(static_cast<std::size_t>(sent));
      else if (errno != EINTR && (errno != EAGAIN || !await(POLLOUT, until_s)))
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
      if (!await(POLLIN, until_s)) return 0;
    }
  }

  void sleepUntil(double until_s) noexcept override {
    const timespec until = timeOf(until_s);
    while (clock_nanosleep(CLOCK_MONOTONIC, TIMER_ABSTIME, &until, nullptr) == EINTR) {
    }
  }

  double time_s() const noexcept override { return now_s(); }

 private:
  bool await(short events, double until_s) const noexcept {
    for (;;) {
      const double left_s = until_s - now_s();
      if (left_s <= 0) return false;
      const timespec wait = timeOf(left_s);
      pollfd wanted{descriptor_, events, 0};
      const int ready = ::ppoll(&wanted, 1, &wait, nullptr);
      if (ready > 0) return true;
      if (ready < 0 && errno != EINTR) return false;
    }
  }

  int descriptor_;
};

// Returns the descriptor, or -1 with the reason in `why`.
int connectTo(const addrinfo& address, double timeout_s, std::string& why) {
  const int descriptor = ::socket(address.ai_family, address.ai_socktype | SOCK_CLOEXEC | SOCK_NONBLOCK, 0);
  if (descriptor < 0) {
    why = std::strerror(errno);
    return -1;
  }
  int error = ::connect(descriptor, address.ai_addr, address.ai_addrlen) == 0 ? 0 : errno;
  if (error == EINPROGRESS) {
    pollfd wanted{descriptor, POLLOUT, 0};
    const timespec wait = timeOf(timeout_s);
    error = ETIMEDOUT;
    socklen_t size = sizeof error;
    if (::ppoll(&wanted, 1, &wait, nullptr) > 0) getsockopt(descriptor, SOL_SOCKET, SO_ERROR, &error, &size);
  }
  if (error == 0) return descriptor;
  why = std::strerror(error);
  ::close(descriptor);
  return -1;
}

}  // namespace

std::unique_ptr<ByteStream> connectTcp(const std::string& host, std::uint16_t port, double timeout_s) {
  addrinfo hints{};
  hints.ai_socktype = SOCK_STREAM;
  addrinfo* found = nullptr;
  const std::string at = host + ':' + std::to_string(port);
  if (const int error = getaddrinfo(host.c_str(), std::to_string(port).c_str(), &hints, &found); error != 0)
    throw DeviceError(at + ": " + gai_strerror(error));
  const std::unique_ptr<addrinfo, void (*)(addrinfo*)> addresses(found, freeaddrinfo);
  std::string why;
  for (const addrinfo* address = found; address != nullptr; address = address->ai_next)
    if (const int descriptor = connectTo(*address, timeout_s, why); descriptor >= 0)
      return std::make_unique<TcpStream>(descriptor);
  throw DeviceError(at + ": " + why);
}

}  // namespace filiform
