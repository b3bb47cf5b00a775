// Compresses answers. Function without state.
#pragma once

#include "tools/words/answer.h"

namespace filiform::tools {

// Makes text of more than 1 KiB gzip, for a client that takes it. Not parts, nor what has a tag of its very bytes. If
// the time for the answer is over, it stays as it is. O(length).
void compress(Answer& answer);

}  // namespace filiform::tools
