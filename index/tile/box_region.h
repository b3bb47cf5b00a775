// BoxRegion: a closed box as a part of the world against which boxes are tested.
#pragma once

#include "index/tile/tile_engine.h"

namespace filiform {

// Thread rule: immutable value.
struct BoxRegion final : Region {
  WorldBox box;

  explicit BoxRegion(const WorldBox& b) : box(b) {}
  bool mayMeet(const WorldBox& other) const noexcept override {
    return (box.lo_W.array() <= other.hi_W.array()).all() && (box.hi_W.array() >= other.lo_W.array()).all();
  }
};

}  // namespace filiform
