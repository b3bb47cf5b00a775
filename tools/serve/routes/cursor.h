// Cursor: where an answer that comes in parts goes on. Its text names the revision of the set, so that the parts of one
// answer are of one revision. Functions without state.
#pragma once

#include "tools/serve/routes/service.h"

#include <cstdint>
#include <initializer_list>
#include <optional>
#include <string>
#include <vector>

namespace filiform::tools {

// The text for a place in the call's set.
std::string cursorText(const Call& call, std::initializer_list<std::uint64_t> place);

// The place of the parameter `cursor`, of `numbers` numbers: zeros for `start`, nullopt without the parameter. Throws
// Refusal: 400 for any other text, 410 if the set has another revision now.
std::optional<std::vector<std::uint64_t>> cursorOf(const Call& call, std::size_t numbers);

}  // namespace filiform::tools
