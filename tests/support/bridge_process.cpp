#include "tests/support/bridge_process.h"

#include <arpa/inet.h>
#include <cerrno>
#include <csignal>
#include <cstdlib>
#include <fcntl.h>
#include <netinet/in.h>
#include <stdexcept>
#include <sys/prctl.h>
#include <sys/socket.h>
#include <sys/wait.h>
#include <unistd.h>

namespace filiform::test {

BridgeProcess::BridgeProcess(const std::string& address, const std::string& log, const std::string& name) {
  const std::string program = bridgeProgram(name);
  int ends[2];
  if (::pipe2(ends, O_CLOEXEC) != 0) throw std::runtime_error("cannot make a pipe");
  process_ = ::fork();
  if (process_ == 0) {
    ::prctl(PR_SET_PDEATHSIG, SIGKILL);
    ::dup2(ends[1], 1);
    if (!log.empty()) ::setenv("FILIFORM_BRIDGE_LOG", log.c_str(), 1);
    ::execl(program.c_str(), program.c_str(), address.empty() ? nullptr : address.c_str(), nullptr);
    ::_exit(127);
  }
  ::close(ends[1]);
  for (char c = 0; ::read(ends[0], &c, 1) == 1 && c != '\n';) line_ += c;
  ::close(ends[0]);
  if (!line_.empty()) return;
  const int code = wait();
  throw std::runtime_error("the bridge did not start: exit code " + std::to_string(code));
}

BridgeProcess::~BridgeProcess() {
  if (process_ < 0) return;
  ::kill(process_, SIGKILL);
  wait();
}

void BridgeProcess::signal(int signal) const { ::kill(process_, signal); }

int BridgeProcess::wait() {
  int status = 0;
  while (::waitpid(process_, &status, 0) < 0 && errno == EINTR) {
  }
  process_ = -1;
  return WIFEXITED(status) ? WEXITSTATUS(status) : 128 + WTERMSIG(status);
}

std::string bridgeProgram(const std::string& name) { return FILIFORM_BRIDGES "/" + name; }

int freeDatagramPort() {
  sockaddr_in address{};
  address.sin_family = AF_INET;
  address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
  socklen_t size = sizeof address;
  auto* const any = reinterpret_cast<sockaddr*>(&address);
  const int socket = ::socket(AF_INET, SOCK_DGRAM | SOCK_CLOEXEC, 0);
  const bool bound = ::bind(socket, any, size) == 0 && ::getsockname(socket, any, &size) == 0;
  ::close(socket);
  if (!bound) throw std::runtime_error("no port is free");
  return ntohs(address.sin_port);
}

}  // namespace filiform::test
