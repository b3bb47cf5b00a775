// The text of the error that a call throws. Thread rule: as the call.
#pragma once

#include <string>

namespace filiform::test {

// "no error" if it throws none; errors that are no Failure propagate.
template <typename Failure, typename Call>
std::string whatOf(const Call& call) {
  try {
    call();
  } catch (const Failure& failure) {
    return failure.what();
  }
  return "no error";
}

}  // namespace filiform::test
