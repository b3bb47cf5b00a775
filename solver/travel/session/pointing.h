// Pointing: where the pointer of a session pulls the hand. Thread rule: a value.
#pragma once

#include "index/geometry/grid.h"

#include <cstdint>

namespace filiform {

// The target that the pointer gives the hand.
struct Pointing {
  enum class Kind : std::uint8_t {
    rest,  // the hand stays at the proxy, without force
    at,    // the hand is pulled to the point target_D
    push,  // the hand is pulled to the proxy's position plus target_D, so the proxy continues to travel
  };
  Kind kind = Kind::rest;
  Vector3d target_D = Vector3d::Zero();  // m

  static Pointing at(const Vector3d& target_D) { return {Kind::at, target_D}; }
  static Pointing push(const Vector3d& by_D) { return {Kind::push, by_D}; }
};

}  // namespace filiform
