#include "device/bridge/internal/bridge_socket.h"

#include "device/haptic_device.h"

#include <algorithm>
#include <arpa/inet.h>
#include <cerrno>
#include <cstdlib>
#include <cstring>
#include <fcntl.h>
#include <netinet/in.h>
#include <sys/socket.h>
#include <sys/stat.h>
#include <sys/un.h>
#include <unistd.h>

namespace filiform::internal {

namespace {

sockaddr_un unixAddress(const std::string& path) {
  sockaddr_un address{};
  address.sun_family = AF_UNIX;
  if (path.size() >= sizeof address.sun_path)
    throw DeviceError(path + ": too long for a socket; at most " + std::to_string(sizeof address.sun_path - 1) +
                      " bytes");
  std::copy(path.begin(), path.end(), address.sun_path);
  return address;
}

}  // namespace

OwnedDescriptor connectToPath(const std::string& path) {
  const sockaddr_un address = unixAddress(path);
  OwnedDescriptor socket(::socket(AF_UNIX, SOCK_SEQPACKET | SOCK_CLOEXEC | SOCK_NONBLOCK, 0));
  if (socket.number < 0 || ::connect(socket.number, reinterpret_cast<const sockaddr*>(&address), sizeof address) != 0)
    throw DeviceError(path + ": no bridge listens there (" + std::strerror(errno) +
                      "); start it first, as in: simulated " + path);
  ucred user{};
  socklen_t size = sizeof user;
  if (::getsockopt(socket.number, SOL_SOCKET, SO_PEERCRED, &user, &size) != 0 || user.uid != ::geteuid())
    throw DeviceError(path + ": the bridge belongs to another user; start your own");
  return socket;
}

OwnedDescriptor connectToPort(const std::string& address) {
  const std::size_t colon = address.rfind(':');
  const std::string host = colon < 4 ? "" : address.substr(4, colon - 4);
  const std::string port = address.substr(colon + 1);
  sockaddr_in there{};
  there.sin_family = AF_INET;
  const bool is_number = !port.empty() && port.size() < 6 && port.find_first_not_of("0123456789") == std::string::npos;
  const int number = is_number ? std::stoi(port) : 0;
  if (::inet_pton(AF_INET, host == "localhost" ? "127.0.0.1" : host.c_str(), &there.sin_addr) != 1 ||
      ntohl(there.sin_addr.s_addr) >> 24 != 127 || number < 1 || number > 65535)
    throw DeviceError("bridge:" + address + ": give bridge:udp:127.0.0.1:PORT, an address of this machine");
  there.sin_port = htons(static_cast<std::uint16_t>(number));
  OwnedDescriptor socket(::socket(AF_INET, SOCK_DGRAM | SOCK_CLOEXEC | SOCK_NONBLOCK, 0));
  if (socket.number < 0 || ::connect(socket.number, reinterpret_cast<const sockaddr*>(&there), sizeof there) != 0)
    throw DeviceError("bridge:" + address + ": " + std::strerror(errno));
  return socket;
}

std::array<unsigned char, FB_COOKIE_BYTES> readCookie(const std::string& path) {
  const OwnedDescriptor file(::open(path.c_str(), O_RDONLY | O_CLOEXEC | O_NOFOLLOW));
  if (file.number < 0)
    throw DeviceError(path + ": " + std::strerror(errno) +
                      "; it holds the cookie of a bridge at a port, which makes it");
  struct stat found {};
  if (::fstat(file.number, &found) != 0 || found.st_uid != ::geteuid() || (found.st_mode & 077) != 0)
    throw DeviceError(path + ": must belong to you, and only you may read it: chmod 600");
  char digits[2 * FB_COOKIE_BYTES];
  std::array<unsigned char, FB_COOKIE_BYTES> cookie{};
  bool whole = ::read(file.number, digits, sizeof digits) == static_cast<ssize_t>(sizeof digits);
  for (std::size_t i = 0; i < sizeof digits && whole; ++i) {
    const char c = digits[i];
    const int value = c >= '0' && c <= '9' ? c - '0' : c >= 'a' && c <= 'f' ? c - 'a' + 10 : -1;
    whole = value >= 0;
    cookie[i / 2] = static_cast<unsigned char>(16 * cookie[i / 2] + value);
  }
  if (!whole)
    throw DeviceError(path + ": does not begin with 32 hexadecimal digits; remove it, and start the bridge again");
  return cookie;
}

}  // namespace filiform::internal
