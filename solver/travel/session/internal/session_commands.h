// The commands of a session, stored beside its recording in FILE.json. With both files, a replay goes through the same
// states. Thread rule: values and functions without state; not for the haptic thread.
#pragma once

#include "index/set/tile_store.h"
#include "solver/proxy/proxy_solver.h"
#include "solver/workspace/button_map.h"
#include "solver/workspace/navigation_link.h"

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

namespace filiform::internal {

struct SessionCommand {
  std::uint64_t tick = 0;  // applied after this number of ticks of Navigation
  NavigationCommand command;
};

struct SessionCommands {
  double zoom_um = 0, stiffness_N_m = 0, rate_Hz = 0, leap = 1;
  SolverMethod method = SolverMethod::climb;
  std::optional<ButtonMap> buttons{};      // none: an older file
  std::vector<SessionCommand> commands{};  // in order
};

// Throws IoError if the file cannot be read. Throws InputError if the file does not hold commands, or if a place lies
// in a tile or a cell that the scene does not have.
SessionCommands readSessionCommands(const std::string& path, const TileStore& scene);
// Throws as Output does.
void writeSessionCommands(const std::string& path, const SessionCommands& commands);

}  // namespace filiform::internal
