// A virtual display (Xvfb) with keys and mouse (xdotool), for tests of the window. tools/setup installs both.
#pragma once

#include <string>
#include <sys/types.h>

namespace filiform::test {

// Starts `bash -c line`; the caller waits for it. -1: not started.
pid_t startInShell(const std::string& line);

class VirtualDisplay {
 public:
  static bool isInstalled();
  // The display of this program, such as ":99": started at the first call, ended with the program. Empty: it did not
  // start.
  static const std::string& name();
  // xdotool with these arguments. False: it failed.
  static bool send(const std::string& arguments);
};

}  // namespace filiform::test
