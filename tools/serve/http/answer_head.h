// The head of an HTTP answer: status line and headers, to the empty line. Functions without state.
#pragma once

#include "tools/words/answer.h"

#include <cstdint>
#include <string>

namespace filiform::tools {

// `keep`: the connection stays open. `time_s`: since 1970, for Date. Requires values without line ends.
std::string answerHead(const Answer& answer, bool keep, std::int64_t time_s);

}  // namespace filiform::tools
