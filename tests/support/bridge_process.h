// A bridge of tools/bridges as a process.
#pragma once

#include <string>
#include <sys/types.h>

namespace filiform::test {

class BridgeProcess {
 public:
  // Starts `NAME ADDRESS`, without an address if it is empty, and waits until it listens. Throws std::runtime_error if
  // it does not. `log`: file for the rendered forces; empty: none.
  explicit BridgeProcess(const std::string& address, const std::string& log = "",
                         const std::string& name = "simulated");
  ~BridgeProcess();  // kills it if it still runs
  BridgeProcess(const BridgeProcess&) = delete;
  BridgeProcess& operator=(const BridgeProcess&) = delete;

  const std::string& line() const { return line_; }  // that it printed
  void signal(int signal) const;
  int wait();  // the exit code; 128 + signal if a signal killed it

 private:
  pid_t process_ = -1;
  std::string line_;
};

// The path of a bridge's program, as built beside the tests.
std::string bridgeProgram(const std::string& name = "simulated");

// A port of 127.0.0.1 at which no program receives datagrams: another program may take it first.
int freeDatagramPort();

}  // namespace filiform::test
