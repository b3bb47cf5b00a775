// Errors of reading over HTTP that callers tell apart.
#pragma once

#include "index/errors.h"

namespace filiform::internal {

// The server has no such file (404, 410).
class NotOnServer : public IoError {
 public:
  using IoError::IoError;
};

}  // namespace filiform::internal
