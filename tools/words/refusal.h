// Refusal: why a request gets no answer, as an HTTP status and one line. Thread rule: a value.
#pragma once

#include "index/errors.h"

#include <string>
#include <utility>

namespace filiform::tools {

class Refusal : public Error {
 public:
  // `detail`: what is wrong, and what to do; text of the request in it is escaped.
  Refusal(unsigned status, const std::string& detail) : Error(detail), status_(status) {}
  unsigned status() const { return status_; }

 private:
  unsigned status_;
};

// The time for an answer is over.
class AnswerTimeout : public Refusal {
 public:
  AnswerTimeout()
      : Refusal(
            503,
            "the answer takes more than 5 s; ask for less, again when its tiles are in memory, or, of a box or many "
            "points, in parts with cursor=start") {}
};

}  // namespace filiform::tools
