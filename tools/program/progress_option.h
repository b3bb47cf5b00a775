// The option --progress of commands that take long. Thread rule: as cli.h.
#pragma once

namespace CLI {
class App;
}

namespace filiform::tools {

// Adds --progress auto|json|none, which sets the style of all Progress objects made later (progress.h).
void addProgressOption(CLI::App& command);

}  // namespace filiform::tools
