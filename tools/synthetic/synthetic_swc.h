// A synthetic neuron as SWC text, and as the cell that a reader of the text gets. Functions without state.
#pragma once

#include "index/cell/cell.h"
#include "tools/synthetic/synthetic_neuron.h"

#include <string>
#include <vector>

namespace filiform::tools {

// Returns SWC with three decimals. `comments` (without "# ") follow the line that names the origin. O(samples).
std::string swcText(const Neuron& neuron, const std::vector<std::string>& comments);

// Returns the cell that readSwc makes of `text`, digest included. `text` must be swcText() of `neuron`. O(samples).
Cell cellOf(const Neuron& neuron, const std::string& text, std::string source);

}  // namespace filiform::tools
