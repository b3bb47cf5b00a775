// `view --follow`: the window shows where it is at the address of a server, for pages that look on.
// Thread rule: the main thread.
#pragma once

#include "viewer/window/application.h"

#include <memory>
#include <string>
#include <vector>

namespace filiform::tools {

class Follow {
 public:
  // `token`: of the set's own host, if the set is at an address. It is sent to this host only. Throws UsageError for a
  // wrong address, and for scenes that no page shows.
  Follow(const std::string& address, const std::vector<std::string>& scene, const std::string& token);
  ~Follow();

  // For ApplicationOptions::observe. Returns lines for the user, which also go to standard error.
  std::vector<std::string> observe(const OpenedScene& scene, const NavigationSnapshot& now);
  // For ApplicationOptions::poll. Throws UsageError if the server refused this desk before it ever accepted it.
  void throwIfRefused() const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace filiform::tools
