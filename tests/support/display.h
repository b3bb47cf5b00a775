// A virtual display (Xvfb) with keys and mouse (xdotool), for tests of the window. tools/setup installs both.
#pragma once

#include <string>
#include <sys/types.h>

namespace filiform::test {

// Starts `bash -c line`. The caller waits for it. Returns -1 if it cannot be started.
pid_t startInShell(const std::string& line);

class VirtualDisplay {
 public:
  static bool isInstalled();
  // The display of this program, such as ":99". The first call starts it; it ends with the program. Empty: it could not
  // be started.
  static const std::string& name();
  // Runs xdotool with these arguments. Returns false if it failed.
  static bool send(const std::string& arguments);
};

}  // namespace filiform::test
