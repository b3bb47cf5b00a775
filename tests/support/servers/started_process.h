// A program that runs beside a test, and says on its first line that it is ready.
#pragma once

#include <string>
#include <sys/types.h>
#include <vector>

namespace filiform::test {

class StartedProcess {
 public:
  // Starts a program with its arguments, and waits for the first line that it prints. Throws std::runtime_error if it
  // ends without one. `err`: file for its standard error; empty: that of the test. `variables`: NAME=VALUE, added to
  // the environment.
  explicit StartedProcess(std::vector<std::string> words, const std::string& err = "",
                          std::vector<std::string> variables = {});
  ~StartedProcess();  // kills it if it still runs
  StartedProcess(const StartedProcess&) = delete;
  StartedProcess& operator=(const StartedProcess&) = delete;

  const std::string& line() const { return line_; }
  pid_t processId() const { return process_; }
  void signal(int signal) const;
  int wait();  // the exit code; 128 + signal if a signal killed it

 private:
  pid_t process_ = -1;
  std::string line_;
};

}  // namespace filiform::test
