#include "tools/serve/session/ticker_pool.h"

#include <array>
#include <vector>

#include <gtest/gtest.h>

namespace filiform::tools {
namespace {

TEST(TickerPool, TheThreadWithTheLeastLoadTakesTheNextSession) {
  const std::array<TickerLoad, 3> loads{TickerLoad{.sessions = 4, .share = 0.4},
                                        TickerLoad{.sessions = 2, .share = 0.2},
                                        TickerLoad{.sessions = 3, .share = 0.3}};
  EXPECT_EQ(placeOfNext(loads), 1U);
  EXPECT_EQ(placeOfNext(std::array<TickerLoad, 2>{}), 0U);
  EXPECT_EQ(placeOfNext({}), std::nullopt);
}

TEST(TickerPool, AThreadTakesSessionsUntilTheirHandsTakeItsTime) {
  TickerLoad one{.sessions = 11, .share = 11 * 0.055};
  EXPECT_EQ(placeOfNext({&one, 1}), 0U);
  one = {.sessions = 12, .share = 12 * 0.055};
  EXPECT_EQ(placeOfNext({&one, 1}), std::nullopt);
  // Those that came since are thought to take as much as the others.
  one = {.sessions = 11, .newcomers = 3, .share = 8 * 0.055};
  EXPECT_EQ(placeOfNext({&one, 1}), 0U);
  one = {.sessions = 12, .newcomers = 4, .share = 8 * 0.055};
  EXPECT_EQ(placeOfNext({&one, 1}), std::nullopt);
}

TEST(TickerPool, HandsThatRestKeepAPlaceForTheirMotion) {
  TickerLoad one;
  while (placeOfNext({&one, 1})) ++one.sessions;
  EXPECT_NEAR(static_cast<double>(one.sessions), kMostShare / (kShareOfHand / 2), 1);
  one = {};
  while (placeOfNext({&one, 1})) ++one.sessions, ++one.newcomers;
  EXPECT_NEAR(static_cast<double>(one.sessions), kMostShare / kShareOfHand, 1);
}

TEST(TickerPool, AThreadThatIsLateByItsOwnWorkTakesNone) {
  const TickerLoad busy{.sessions = 8, .share = 0.4, .late = 0.05}, held_up{.sessions = 1, .share = 0.05, .late = 0.05};
  EXPECT_EQ(placeOfNext({&busy, 1}), std::nullopt);
  EXPECT_EQ(placeOfNext({&held_up, 1}), 0U);  // others took its processor
}

TEST(TickerPool, APlaceThatIsLeftIsTakenAgain) {
  TickerPool pool(2, [] {});
  std::vector<std::size_t> places;
  while (const std::optional<std::size_t> place = pool.enter()) places.push_back(*place);
  EXPECT_NEAR(static_cast<double>(places.size()), 2 * kMostShare / kShareOfHand, 2);
  pool.leave(places.back());
  EXPECT_EQ(pool.enter(), places.back());
}

}  // namespace
}  // namespace filiform::tools
