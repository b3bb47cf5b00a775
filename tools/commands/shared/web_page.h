// `view --web`: travel in a browser of this machine. Thread rule: the main thread.
#pragma once

#include "tools/commands/shared/remote_arguments.h"

#include <memory>
#include <string>

namespace filiform::tools {

// Serves the set at a free port of loopback, with a token of its own, opens its page, and waits until it is
// interrupted. Returns the exit code. Throws UsageError if the page is not built; what opening the set throws.
int travelInBrowser(const std::string& set, const std::shared_ptr<const RemoteArguments>& remote);

}  // namespace filiform::tools
