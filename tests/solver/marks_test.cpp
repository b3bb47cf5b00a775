#include "solver/marks.h"

#include <random>
#include <set>
#include <utility>

#include <gtest/gtest.h>

namespace filiform {
namespace {

using MarkKind = Marks::Kind;
using Put = Marks::Put;

TEST(Marks, AgreeWithASetThroughEpochsAndUndo) {
  for (std::uint64_t seed = 0; seed < 20; ++seed) {
    SCOPED_TRACE(testing::Message() << "seed " << seed);
    std::mt19937_64 random(seed);
    constexpr std::uint32_t capacity = 300, in_tick = 40;
    Marks marks(capacity, in_tick);
    std::set<std::pair<MarkKind, std::uint64_t>> expected;
    for (int tick = 0; tick < 400; ++tick) {
      const auto before = expected;
      marks.beginTick();
      std::uint32_t fresh = 0;
      for (int i = 0; i < 60; ++i) {
        if (random() % 200 == 0) {
          marks.newEpoch();
          expected.clear();
        }
        const MarkKind kind = random() % 2 == 0 ? MarkKind::segment : MarkKind::node;
        const std::uint64_t key = random() % 250 << (random() % 2 == 0 ? 0 : 32);
        ASSERT_EQ(marks.contains(kind, key), expected.count({kind, key}) == 1);
        const Put put = marks.put(kind, key);
        if (expected.count({kind, key}) == 1) {
          ASSERT_EQ(put, Put::present);
        } else if (expected.size() == capacity || fresh == in_tick) {
          ASSERT_EQ(put, Put::full);
        } else {
          ASSERT_EQ(put, Put::fresh);
          expected.insert({kind, key});
          ++fresh;
        }
        ASSERT_EQ(marks.size(), expected.size());
      }
      if (random() % 3 == 0) {
        marks.undo();
        expected = before;
        ASSERT_EQ(marks.size(), expected.size());
        for (const auto& [kind, key] : expected) ASSERT_TRUE(marks.contains(kind, key));
      }
    }
  }
}

TEST(Marks, ASegmentAndANodeOfTheSameNumberDoNotMeet) {
  Marks marks(10, 10);
  marks.beginTick();
  EXPECT_EQ(marks.put(MarkKind::segment, 7), Put::fresh);
  EXPECT_FALSE(marks.contains(MarkKind::node, 7));
  EXPECT_EQ(marks.put(MarkKind::node, 7), Put::fresh);
  EXPECT_EQ(marks.put(MarkKind::segment, 7), Put::present);
}

TEST(Marks, HoldTheirCapacityOfNeighbouringKeysInEveryEpoch) {
  constexpr std::uint32_t capacity = 5000;
  Marks marks(capacity, capacity);
  for (int epoch = 0; epoch < 5; ++epoch) {
    marks.beginTick();
    marks.newEpoch();
    for (std::uint64_t key = 0; key < capacity; ++key)
      ASSERT_EQ(marks.put(MarkKind::node, key << 32 | key), Put::fresh);
    for (std::uint64_t key = 0; key < capacity; ++key) ASSERT_TRUE(marks.contains(MarkKind::node, key << 32 | key));
    EXPECT_EQ(marks.put(MarkKind::node, 1), Put::full);
    EXPECT_FALSE(marks.contains(MarkKind::node, 1));
  }
}

}  // namespace
}  // namespace filiform
