// HttpLanding: how a request to a server ended. Thread rule: a value.
#pragma once

#include <cstdint>
#include <string>

namespace filiform::internal {

// What became of a request.
struct HttpLanding {
  enum class Kind : std::uint8_t { done, redirect, retry, missing, ends, refused, denied };
  Kind kind = Kind::done;
  std::string what = {};         // retry, missing, refused, denied: what is wrong
  std::string remedy = {};       // what to do; empty: about the network
  std::string target = {};       // redirect: to where
  double wait_s = 0;             // retry: the server asks for this wait
  std::uint64_t file_bytes = 0;  // ends: the file ends before the end of the range
};

}  // namespace filiform::internal
