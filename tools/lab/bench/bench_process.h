// A forked process of a benchmark, killed at the end of the scope.
#pragma once

#include <csignal>
#include <functional>
#include <stdexcept>
#include <sys/prctl.h>
#include <sys/wait.h>
#include <unistd.h>

namespace filiform::tools {

class BenchProcess {
 public:
  explicit BenchProcess(const std::function<void()>& work) : process_(::fork()) {
    if (process_ < 0) throw std::runtime_error("bench: no process can be started");
    if (process_ > 0) return;
    ::prctl(PR_SET_PDEATHSIG, SIGKILL);
    try {
      work();
    } catch (const std::exception&) {
      ::_exit(1);
    }
    ::_exit(0);
  }
  ~BenchProcess() {
    ::kill(process_, SIGKILL);
    ::waitpid(process_, nullptr, 0);
  }
  BenchProcess(const BenchProcess&) = delete;
  BenchProcess& operator=(const BenchProcess&) = delete;
  void signal(int signal) const { ::kill(process_, signal); }

 private:
  pid_t process_;
};

}  // namespace filiform::tools
