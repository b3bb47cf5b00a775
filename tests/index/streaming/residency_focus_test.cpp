// Many hands that share the table of one reader.
#include "index/streaming/residency.h"
#include "tests/index/streaming/residency_fixture.h"

#include <vector>

#include <gtest/gtest.h>

namespace filiform {
namespace {

using test::ResidencyTest;

TEST_F(ResidencyTest, HandsAtOneTableEachGetTheirTiles) {
  Residency residency(*store_, options(UINT64_MAX, PrefetchPolicy::none));
  TileReader& reader = residency.addReader("hands");
  std::vector<TileFocus*> hands;
  for (TileId tile = 0; tile < 4; ++tile) {
    hands.push_back(&residency.addFocus());
    hands.back()->publishFocus(focusOn(tile, 1.0));
  }
  hands[1]->request(5);
  double now = 0;
  for (int i = 0; i < 40; ++i) {
    residency.serve(now += 0.01);
    reader.apply();
  }
  for (const TileId tile : {0u, 1u, 2u, 3u, 5u}) EXPECT_NE(reader.tiles().find(tile), nullptr) << tile;
  for (TileFocus* const hand : hands) residency.removeFocus(*hand);
  residency.serve(now += 1);
}

TEST_F(ResidencyTest, TileOfAHandStaysPinnedUntilTheHandIsRemoved) {
  Residency residency(*store_, options(Residency::floorBytes(*store_), PrefetchPolicy::none));
  TileReader& reader = residency.addReader("hands");
  TileFocus& hand = residency.addFocus();
  hand.publishFocus(focusOn(0, 1.0));
  double now = 0;
  const auto serve = [&] {
    residency.serve(now += 0.3);
    reader.apply();
  };
  for (int i = 0; i < 5; ++i) serve();
  for (TileId tile = 1; tile < count(); ++tile) {
    hand.request(tile);
    serve(), serve();
    ASSERT_NE(reader.tiles().find(0), nullptr) << "pinned by a hand";
  }
  residency.removeFocus(hand);
  TileFocus& other = residency.addFocus();
  for (TileId tile = 1; tile < count() && reader.tiles().find(0) != nullptr; ++tile) {
    other.request(tile);
    serve(), serve(), serve();
  }
  EXPECT_EQ(reader.tiles().find(0), nullptr);
}

}  // namespace
}  // namespace filiform
