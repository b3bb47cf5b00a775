#include "tests/support/display.h"

#include "tests/support/temp_folder.h"

#include <chrono>
#include <csignal>
#include <cstdlib>
#include <fstream>
#include <spawn.h>
#include <sys/wait.h>
#include <thread>

extern char** environ;

namespace filiform::test {

namespace {

bool isThere(const std::string& program) {
  return std::system(("command -v " + program + " >/dev/null 2>&1").c_str()) == 0;
}

struct Server {
  TempFolder folder;
  pid_t pid;
  std::string name;

  // The server reports the number of its display.
  Server() {
    const std::string number = folder / "display";
    pid = startInShell("exec Xvfb -displayfd 3 -screen 0 1400x900x24 -nolisten tcp 3>'" + number + "' >/dev/null 2>&1");
    for (int i = 0; i < 300 && name.empty(); ++i) {
      std::this_thread::sleep_for(std::chrono::milliseconds(100));
      std::ifstream(number) >> name;
    }
    if (!name.empty()) name.insert(0, ":");
  }
  ~Server() {
    if (pid <= 0) return;
    kill(pid, SIGTERM);
    waitpid(pid, nullptr, 0);
  }
};

}  // namespace

pid_t startInShell(const std::string& line) {
  const char* const arguments[] = {"bash", "-c", line.c_str(), nullptr};
  pid_t pid = -1;
  if (posix_spawnp(&pid, "bash", nullptr, nullptr, const_cast<char* const*>(arguments), environ) != 0) return -1;
  return pid;
}

bool VirtualDisplay::isInstalled() { return isThere("Xvfb") && isThere("xdotool"); }

const std::string& VirtualDisplay::name() {
  static const Server server;
  return server.name;
}

bool VirtualDisplay::send(const std::string& arguments) {
  return std::system(("DISPLAY=" + name() + " xdotool " + arguments).c_str()) == 0;
}

}  // namespace filiform::test
