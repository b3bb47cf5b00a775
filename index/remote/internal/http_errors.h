// Errors of reading over HTTP that callers tell apart.
#pragma once

#include "index/errors.h"

namespace filiform::internal {

// The server has no such file (404, 410).
class NotOnServer : public IoError {
 public:
  using IoError::IoError;
};

// The server refuses access (403). An object store also answers 403 for a missing file, if the client may not list the
// bucket.
class DeniedByServer : public IoError {
 public:
  using IoError::IoError;
};

}  // namespace filiform::internal
