// What an object store says when it does not answer as asked. Thread rule: pure function.
#pragma once

#include "index/remote/internal/http_landing.h"
#include "index/remote/internal/s3_account.h"

#include <optional>
#include <string>

namespace filiform::internal {

struct S3Answer {
  long status = 0;
  std::string body{};                     // its beginning; empty for an answer to HEAD
  std::string region{};                   // of the bucket, if the store states it
  std::optional<double> clock_ahead_s{};  // of this machine, by the store's Date
};

// The landing of an answer that is neither 2xx nor a redirect with a target. `otherwise`: that of any server.
HttpLanding judgeS3(const S3Answer& answer, const S3Account& account, HttpLanding otherwise);

// The text of the first element `<name>` of an XML document without nested elements of this name; empty: none.
std::string xmlText(std::string_view xml, std::string_view name);

}  // namespace filiform::internal
