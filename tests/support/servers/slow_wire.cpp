// A relay that makes a TCP connection on this machine slow and unreliable. `tests/support/servers/slow_wire` builds and
// runs it.
//
//   slow_wire HOST:PORT [--listen PORT] [--delay MS] [--rate BYTES] [--stall-every N --stall MS] [--reset-every N]
//             [--flip-every N]
//
// It prints its own port, then the round trip that it measured through itself, then relays until standard input ends.
//   --delay MS        round trip: each direction takes half. The first bytes of a connection take one more, as its
//                     handshake would. Default: 20
//   --rate BYTES      most bytes a second towards the client, of all connections together; default: no limit
//   --stall-every N   each Nth piece of data towards the client waits --stall MS more (default: 1000)
//   --reset-every N   each Nth connection is reset after its first answer
//   --flip-every N    in each Nth piece of data towards the client one bit is inverted
#include <algorithm>
#include <arpa/inet.h>
#include <chrono>
#include <cstdio>
#include <cstdlib>
#include <deque>
#include <list>
#include <map>
#include <netinet/in.h>
#include <netinet/tcp.h>
#include <poll.h>
#include <string>
#include <sys/epoll.h>
#include <sys/socket.h>
#include <sys/timerfd.h>
#include <thread>
#include <unistd.h>
#include <vector>

namespace {

using Clock = std::chrono::steady_clock;
using Milliseconds = std::chrono::duration<double, std::milli>;

[[noreturn]] void fail(const std::string& what) {
  std::fprintf(stderr, "slow_wire: %s\n", what.c_str());
  std::exit(2);
}

struct Options {
  std::string target;
  double listen = 0, delay = 20, rate = 0, stall_every = 0, stall = 1000, reset_every = 0, flip_every = 0;
};

Options parse(int argc, char** argv) {
  Options options;
  const std::map<std::string, double Options::*> numbers{
      {"--listen", &Options::listen},           {"--delay", &Options::delay}, {"--rate", &Options::rate},
      {"--stall-every", &Options::stall_every}, {"--stall", &Options::stall}, {"--reset-every", &Options::reset_every},
      {"--flip-every", &Options::flip_every}};
  for (int i = 1; i < argc; ++i) {
    const auto number = numbers.find(argv[i]);
    if (number == numbers.end()) {
      options.target = argv[i];
    } else {
      char* end = nullptr;
      options.*number->second = ++i < argc ? std::strtod(argv[i], &end) : -1;
      if (end == nullptr || *end != '\0' || options.*number->second < 0) fail(number->first + " needs a number >= 0");
    }
  }
  if (options.target.find(':') == std::string::npos) fail("name the target as HOST:PORT");
  return options;
}

sockaddr_in addressOf(const std::string& target) {
  const std::size_t colon = target.rfind(':');
  sockaddr_in address{};
  address.sin_family = AF_INET;
  address.sin_port = htons(static_cast<std::uint16_t>(std::stoi(target.substr(colon + 1))));
  const std::string host = target.substr(0, colon) == "localhost" ? "127.0.0.1" : target.substr(0, colon);
  if (::inet_pton(AF_INET, host.c_str(), &address.sin_addr) != 1) fail("the target is no IPv4 address: " + host);
  return address;
}

sockaddr* generic(sockaddr_in& address) { return reinterpret_cast<sockaddr*>(&address); }

int listenAt(int port) {
  const int listener = ::socket(AF_INET, SOCK_STREAM, 0), on = 1;
  ::setsockopt(listener, SOL_SOCKET, SO_REUSEADDR, &on, sizeof on);
  sockaddr_in address = addressOf("127.0.0.1:" + std::to_string(port));
  if (::bind(listener, generic(address), sizeof address) != 0 || ::listen(listener, 1024) != 0)
    fail("cannot listen at port " + std::to_string(port));
  return listener;
}

int portOf(int listener) {
  sockaddr_in address{};
  socklen_t size = sizeof address;
  ::getsockname(listener, generic(address), &size);
  return ntohs(address.sin_port);
}

int connectTo(const std::string& target) {
  const int connection = ::socket(AF_INET, SOCK_STREAM, 0), on = 1;
  sockaddr_in address = addressOf(target);
  ::setsockopt(connection, IPPROTO_TCP, TCP_NODELAY, &on, sizeof on);
  if (::connect(connection, generic(address), sizeof address) == 0) return connection;
  ::close(connection);
  return -1;
}

constexpr std::size_t kPiece = 64 << 10, kMostWaiting = 16 << 20;  // bytes

struct Piece {
  Clock::time_point due;
  std::string bytes;  // empty: the sender has ended
  std::size_t sent = 0;
};

// What comes from one end of a connection and goes to the other.
struct Direction {
  std::deque<Piece> pieces;
  std::size_t waiting = 0;  // bytes
  bool read_all = false, sent_all = false;
};

struct Connection {
  int ends[2];              // client, target
  Direction directions[2];  // from the client, from the target
  bool resets = false, first = true, dead = false;
};

class Relay {
 public:
  Relay(const Options& options, std::string target, int listener)
      : options_(options), target_(std::move(target)), listener_(listener) {
    watch(listener_, EPOLLIN, EPOLL_CTL_ADD);
    watch(timer_, EPOLLIN, EPOLL_CTL_ADD);
  }

  // Relays until there is something to read, or an end, at this descriptor.
  void run(int until) {
    if (!watch(until, EPOLLIN, EPOLL_CTL_ADD)) return;  // a file has ended already
    while (true) {
      setTimer();
      epoll_event events[64];
      const int count = ::epoll_wait(epoll_, events, 64, -1);
      for (int i = 0; i < count; ++i) {
        const int fd = events[i].data.fd;
        if (fd == until) return;
        if (fd == listener_) accept();
        if (fd == timer_) {
          std::uint64_t expirations = 0;
          (void)!::read(timer_, &expirations, sizeof expirations);
        }
        if (const auto found = by_end_.find(fd); found != by_end_.end()) read(*found->second, fd);
      }
      for (auto connection = connections_.begin(); connection != connections_.end();) {
        send(*connection);
        connection = connection->dead ? erase(connection) : std::next(connection);
      }
    }
  }

 private:
  bool watch(int fd, std::uint32_t events, int what) const {
    epoll_event event{};
    event.events = events;
    event.data.fd = fd;
    return ::epoll_ctl(epoll_, what, fd, &event) == 0;
  }

  void setTimer() const {
    Clock::time_point next = Clock::now() + std::chrono::hours(1);
    for (const Connection& connection : connections_)
      for (const Direction& direction : connection.directions)
        if (!direction.pieces.empty()) next = std::min(next, direction.pieces.front().due);
    const auto wait = std::max<std::chrono::nanoseconds>(next - Clock::now(), std::chrono::microseconds(1));
    itimerspec time{};
    time.it_value.tv_sec = wait.count() / 1'000'000'000;
    time.it_value.tv_nsec = wait.count() % 1'000'000'000;
    ::timerfd_settime(timer_, 0, &time, nullptr);
  }

  void accept() {
    const int on = 1, client = ::accept4(listener_, nullptr, nullptr, 0);
    if (client < 0) return;
    const int target = connectTo(target_);
    if (target < 0) {
      ::close(client);
      return;
    }
    ::setsockopt(client, IPPROTO_TCP, TCP_NODELAY, &on, sizeof on);
    ++accepted_;
    Connection& connection = connections_.emplace_back(Connection{{client, target}, {}});
    connection.resets = options_.reset_every > 0 && accepted_ % static_cast<long>(options_.reset_every) == 0;
    for (const int end : connection.ends) {
      by_end_[end] = std::prev(connections_.end());
      watch(end, EPOLLIN, EPOLL_CTL_ADD);
    }
  }

  void read(Connection& connection, int fd) {
    const bool to_client = fd == connection.ends[1];
    Direction& direction = connection.directions[to_client ? 1 : 0];
    std::string bytes(kPiece, '\0');
    const ssize_t n = ::recv(fd, bytes.data(), bytes.size(), MSG_DONTWAIT);
    if (n < 0) {
      if (errno != EAGAIN) connection.dead = true;
      return;
    }
    bytes.resize(static_cast<std::size_t>(n));
    Clock::time_point due = Clock::now() + after(options_.delay / 2);
    if (!to_client && connection.first) {
      connection.first = false;
      due += after(options_.delay);
    }
    if (to_client && n > 0) {
      ++pieces_;
      if (options_.flip_every > 0 && pieces_ % static_cast<long>(options_.flip_every) == 0)
        bytes[bytes.size() / 4 * 3] = static_cast<char>(bytes[bytes.size() / 4 * 3] ^ 4);
      if (options_.stall_every > 0 && pieces_ % static_cast<long>(options_.stall_every) == 0)
        due += after(options_.stall);
      if (options_.rate > 0) due = line_free_ = std::max(line_free_, due) + after(1000 * double(n) / options_.rate);
    }
    if (!direction.pieces.empty()) due = std::max(due, direction.pieces.back().due);
    direction.waiting += bytes.size();
    direction.read_all = n == 0;
    direction.pieces.push_back({due, std::move(bytes)});
    if (direction.read_all || direction.waiting >= kMostWaiting) watch(fd, 0, EPOLL_CTL_DEL);
  }

  static Clock::duration after(double ms) { return std::chrono::duration_cast<Clock::duration>(Milliseconds(ms)); }

  void send(Connection& connection) {
    for (const int side : {0, 1}) {
      Direction& direction = connection.directions[side];
      const int from = connection.ends[side], to = connection.ends[1 - side];
      while (!connection.dead && !direction.pieces.empty() && direction.pieces.front().due <= Clock::now()) {
        Piece& piece = direction.pieces.front();
        if (piece.bytes.empty()) {
          ::shutdown(to, SHUT_WR);
          direction.sent_all = true;
        } else {
          const ssize_t n =
              ::send(to, piece.bytes.data() + piece.sent, piece.bytes.size() - piece.sent, MSG_DONTWAIT | MSG_NOSIGNAL);
          if (n < 0 && errno == EAGAIN) {
            piece.due = Clock::now() + std::chrono::milliseconds(1);
            break;
          }
          if (n < 0) {
            connection.dead = true;
            break;
          }
          piece.sent += static_cast<std::size_t>(n);
          if (piece.sent < piece.bytes.size()) continue;
          if (direction.waiting >= kMostWaiting && !direction.read_all) watch(from, EPOLLIN, EPOLL_CTL_ADD);
          direction.waiting -= piece.bytes.size();
          if (side == 1 && connection.resets) {
            const linger at_once{1, 0};
            ::setsockopt(to, SOL_SOCKET, SO_LINGER, &at_once, sizeof at_once);
            connection.dead = true;
          }
        }
        direction.pieces.pop_front();
      }
    }
    if (connection.directions[0].sent_all && connection.directions[1].sent_all) connection.dead = true;
  }

  std::list<Connection>::iterator erase(std::list<Connection>::iterator connection) {
    for (const int end : connection->ends) {
      by_end_.erase(end);
      ::close(end);
    }
    return connections_.erase(connection);
  }

  const Options& options_;
  const std::string target_;
  const int listener_, epoll_ = ::epoll_create1(0), timer_ = ::timerfd_create(CLOCK_MONOTONIC, TFD_NONBLOCK);
  std::list<Connection> connections_;
  std::map<int, std::list<Connection>::iterator> by_end_;
  Clock::time_point line_free_{};
  long accepted_ = 0, pieces_ = 0;
};

// The median round trip of one byte through a relay to an echo, ms.
double measure(const Options& options) {
  const int far = listenAt(0), near = listenAt(0);
  int ends[2];
  if (::pipe(ends) != 0) fail("cannot make a pipe");
  std::thread echo([far] {
    const int on = 1, connection = ::accept(far, nullptr, nullptr);
    ::setsockopt(connection, IPPROTO_TCP, TCP_NODELAY, &on, sizeof on);
    char byte = 0;
    while (::recv(connection, &byte, 1, 0) == 1) ::send(connection, &byte, 1, MSG_NOSIGNAL);
    ::close(connection);
  });
  Relay relay(options, "127.0.0.1:" + std::to_string(portOf(far)), near);
  std::thread relaying([&] { relay.run(ends[0]); });
  const int client = connectTo("127.0.0.1:" + std::to_string(portOf(near)));
  std::vector<double> took;
  for (int i = 0; i < 22; ++i) {
    const auto begin = Clock::now();
    char byte = 'x';
    ::send(client, &byte, 1, MSG_NOSIGNAL);
    ::recv(client, &byte, 1, 0);
    took.push_back(Milliseconds(Clock::now() - begin).count());
  }
  ::shutdown(client, SHUT_RDWR);
  ::close(client);
  echo.join();
  ::close(ends[1]);
  relaying.join();
  std::sort(took.begin() + 1, took.end());  // without the first, which waits for the handshake
  return took[took.size() / 2];
}

}  // namespace

int main(int argc, char** argv) {
  const Options options = parse(argc, argv);
  Options no_faults = options;
  no_faults.stall_every = no_faults.reset_every = no_faults.flip_every = 0;
  const double round_trip_ms = measure(no_faults);
  const int listener = listenAt(static_cast<int>(options.listen));
  std::printf("port %d\nround trip %.2f ms, asked for %g ms\n", portOf(listener), round_trip_ms, options.delay);
  std::fflush(stdout);
  Relay(options, options.target, listener).run(STDIN_FILENO);
}
