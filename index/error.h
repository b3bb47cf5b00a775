// The base of all errors of all rooms, in a header of its own because devices throw it too. Thread rule: values.
#pragma once

#include <stdexcept>

namespace filiform {

// The base of all errors. what() is one line and safe to print: text from files is escaped beforehand.
class Error : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

}  // namespace filiform
