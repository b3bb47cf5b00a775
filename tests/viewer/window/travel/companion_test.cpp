#include "viewer/window/travel/companion.h"

#include <cmath>
#include <functional>
#include <vector>

#include <gtest/gtest.h>

namespace filiform {
namespace {

TEST(Companion, NumbersThatAreNotFiniteAreFound) {
  EXPECT_TRUE(Companion{}.isFinite());
  const std::vector<std::function<void(Companion&)>> mistakes{[](Companion& c) { c.p_W.x() = std::nan(""); },
                                                              [](Companion& c) { c.h_W.y() = INFINITY; },
                                                              [](Companion& c) { c.centre_W.z() = -INFINITY; },
                                                              [](Companion& c) { c.rotation_WD.w() = std::nan(""); },
                                                              [](Companion& c) { c.rotation_WD.coeffs().setZero(); },
                                                              [](Companion& c) { c.zoom_um = 0; },
                                                              [](Companion& c) { c.zoom_um = INFINITY; },
                                                              [](Companion& c) { c.force_N = std::nan(""); }};
  for (const auto& mistake : mistakes) {
    Companion companion;
    mistake(companion);
    EXPECT_FALSE(companion.isFinite());
  }
}

}  // namespace
}  // namespace filiform
