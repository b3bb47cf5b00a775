// RouteChoice: which route of a cell, or which tour. Thread rule: a value.
#pragma once

#include "index/errors.h"

#include <cstdint>
#include <string>

namespace filiform {

struct RouteChoice {
  enum class Kind : std::uint8_t {
    longest,  // the root-to-tip path of greatest arc length within one tree; ties: lowest ranks
    between,  // two samples by their ids in the file; if ids repeat (restarted blocks), the connected pair of lowest
              // ranks
    random,   // from a random root to one of its tips; the same for a seed on every machine
    tour      // one random route after the other; see Tour
  };
  Kind kind = Kind::longest;
  std::int64_t first = 0, last = 0;  // between
  std::uint64_t seed = 0;            // random, tour

  bool operator==(const RouteChoice&) const = default;
};

// Reads longest, FIRST:LAST, random:SEED or tour:SEED, as commands take them. Throws UsageError for other texts.
RouteChoice routeChoiceOf(const std::string& text);
// The text that gives this choice.
std::string toString(const RouteChoice& choice);

}  // namespace filiform
