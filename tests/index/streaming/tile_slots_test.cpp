#include "index/streaming/internal/tile_slots.h"

#include <algorithm>
#include <map>
#include <random>

#include <gtest/gtest.h>

namespace filiform::internal {
namespace {

TEST(TileSlots, HoldWhatAMapHolds) {
  std::mt19937_64 random(3);
  TileSlots slots(50);
  std::map<TileId, std::pair<TileSlot*, double>> expected;
  for (int step = 0; step < 20000; ++step) {
    const auto tile = static_cast<TileId>(random() % 50);
    const auto known = expected.find(tile);
    TileSlot* const found = slots.find(tile);
    ASSERT_EQ(found != nullptr, known != expected.end()) << "seed 3, step " << step;
    if (random() % 3 == 0) {
      if (found == nullptr) continue;
      slots.erase(*found);
      expected.erase(known);
      continue;
    }
    TileSlot& slot = slots[tile];
    ASSERT_EQ(slot.id, tile);
    if (known == expected.end()) {
      ASSERT_EQ(slot.state, TileState::absent);  // nothing is left of an earlier slot at this place
      ASSERT_EQ(slot.due, 0);
      slot.state = TileState::queued;
      slot.due = step + 1;
      expected[tile] = {&slot, slot.due};
    } else {
      ASSERT_EQ(&slot, known->second.first);  // its address is stable
      ASSERT_EQ(slot.due, known->second.second);
    }
    ASSERT_EQ(slots.all().size(), expected.size());
  }
  std::vector<TileId> listed;
  for (const TileSlot* const slot : slots.all()) listed.push_back(slot->id);
  std::sort(listed.begin(), listed.end());
  ASSERT_EQ(listed.size(), expected.size());
  for (std::size_t i = 0; const auto& [tile, slot] : expected) EXPECT_EQ(listed[i++], tile);
}

}  // namespace
}  // namespace filiform::internal
