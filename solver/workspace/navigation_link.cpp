#include "solver/workspace/navigation_link.h"

namespace filiform {

const char* toString(NavigationMode mode) { return mode == NavigationMode::constrained ? "constrained" : "free"; }

}  // namespace filiform
