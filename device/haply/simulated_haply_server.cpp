#include "device/haply/simulated_haply_server.h"

#include "device/haply/internal/haply_peer.h"

#include <array>
#include <atomic>
#include <cerrno>
#include <cstring>
#include <list>
#include <netinet/in.h>
#include <netinet/tcp.h>
#include <poll.h>
#include <sys/eventfd.h>
#include <sys/socket.h>
#include <thread>
#include <unistd.h>
#include <vector>

namespace filiform {
namespace {

constexpr int kWait_ms = 5;                    // faults are looked at this often
constexpr std::size_t kMostWaiting = 1 << 20;  // bytes that a client does not take

class ServerSocket {
 public:
  explicit ServerSocket(int number) : number_(number) {}
  ~ServerSocket() {
    if (number_ >= 0) ::close(number_);
  }
  ServerSocket(const ServerSocket&) = delete;
  ServerSocket& operator=(const ServerSocket&) = delete;
  int get() const noexcept { return number_; }

 private:
  int number_;
};

struct Client {
  Client(SimulatedHaply& service, int number) : descriptor(number), peer(service) {}
  ServerSocket descriptor;
  internal::HaplyPeer peer;
  std::string out;
  bool ends = false;
};

}  // namespace

struct SimulatedHaplyServer::Impl {
  explicit Impl(SimulatedHaply& of)
      : service(of),
        listening(::socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC | SOCK_NONBLOCK, 0)),
        wake(::eventfd(0, EFD_CLOEXEC | EFD_NONBLOCK)) {}

  SimulatedHaply& service;
  ServerSocket listening, wake;
  std::uint16_t port = 0;
  std::list<Client> clients;
  std::atomic<bool> ends{false};
  std::thread thread;

  // Returns false if the client has gone, or everything was sent to it that it gets.
  bool serve(Client& client, short events) {
    std::array<char, 16 * 1024> bytes;
    if (!client.ends && (events & (POLLIN | POLLHUP | POLLERR)) != 0) {
      const ssize_t got = ::recv(client.descriptor.get(), bytes.data(), bytes.size(), MSG_DONTWAIT);
      if (got == 0 || (got < 0 && errno != EAGAIN && errno != EINTR)) return false;
      if (got > 0) client.ends = !client.peer.take({bytes.data(), static_cast<std::size_t>(got)}, client.out);
    }
    if (!client.ends) client.ends = !client.peer.goOn(client.out);
    if (service.faults().ends || client.out.size() > kMostWaiting) return false;
    while (!client.out.empty()) {
      const ssize_t sent =
          ::send(client.descriptor.get(), client.out.data(), client.out.size(), MSG_DONTWAIT | MSG_NOSIGNAL);
      if (sent < 0 && errno == EINTR) continue;
      if (sent < 0 && errno == EAGAIN) break;
      if (sent < 0) return false;
      client.out.erase(0, static_cast<std::size_t>(sent));
    }
    return !client.ends || !client.out.empty();
  }

  void run() {
    std::vector<pollfd> wanted;
    while (!ends) {
      wanted = {{wake.get(), POLLIN, 0}, {listening.get(), POLLIN, 0}};
      for (const Client& client : clients)
        wanted.push_back({client.descriptor.get(), static_cast<short>(POLLIN | (client.out.empty() ? 0 : POLLOUT)), 0});
      ::poll(wanted.data(), wanted.size(), kWait_ms);
      std::size_t at = 2;
      for (auto client = clients.begin(); client != clients.end(); ++at)
        client = serve(*client, wanted[at].revents) ? std::next(client) : clients.erase(client);
      if ((wanted[1].revents & POLLIN) == 0) continue;
      const int number = ::accept4(listening.get(), nullptr, nullptr, SOCK_CLOEXEC | SOCK_NONBLOCK);
      if (number < 0) continue;
      const int on = 1;
      setsockopt(number, IPPROTO_TCP, TCP_NODELAY, &on, sizeof on);
      clients.emplace_back(service, number);
    }
  }
};

SimulatedHaplyServer::SimulatedHaplyServer(SimulatedHaply& service, std::uint16_t port)
    : impl_(std::make_unique<Impl>(service)) {
  const int on = 1, descriptor = impl_->listening.get();
  setsockopt(descriptor, SOL_SOCKET, SO_REUSEADDR, &on, sizeof on);
  sockaddr_in address{};
  address.sin_family = AF_INET;
  address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
  address.sin_port = htons(port);
  socklen_t size = sizeof address;
  auto* const any = reinterpret_cast<sockaddr*>(&address);
  if (impl_->wake.get() < 0 || ::bind(descriptor, any, size) != 0 || ::listen(descriptor, 8) != 0 ||
      ::getsockname(descriptor, any, &size) != 0)
    throw DeviceError("simulated Haply service: cannot listen on port " + std::to_string(port) + ": " +
                      std::strerror(errno) + "; give another port, or 0 for a free one");
  impl_->port = ntohs(address.sin_port);
  impl_->thread = std::thread([impl = impl_.get()] { impl->run(); });
}

SimulatedHaplyServer::~SimulatedHaplyServer() {
  impl_->ends = true;
  const std::uint64_t one = 1;
  if (::write(impl_->wake.get(), &one, sizeof one) < 0) impl_->ends = true;  // the thread looks within kWait_ms
  impl_->thread.join();
}

std::uint16_t SimulatedHaplyServer::port() const noexcept { return impl_->port; }

}  // namespace filiform
