// Errors of reading over HTTP that callers tell apart.
#pragma once

#include "index/errors.h"

namespace filiform::internal {

// The server has no such file (404, 410).
class NotOnServer : public IoError {
 public:
  using IoError::IoError;
};

// The server allows this to nobody, or not to this client (403). An object store also says so of files that it does not
// have, to those who may not list them.
class DeniedByServer : public IoError {
 public:
  using IoError::IoError;
};

}  // namespace filiform::internal
