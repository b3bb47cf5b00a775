#include "index/tile/internal/narrow_nodes.h"

#include <algorithm>
#include <array>
#include <random>
#include <string>
#include <vector>

#include <gtest/gtest.h>

namespace filiform::internal {
namespace {

using ZigzagStep = std::array<std::uint64_t, 3>;

Bytes encodedSteps(const std::vector<ZigzagStep>& steps) {
  ByteWriter out;
  for (std::size_t begin = 0; begin < steps.size(); begin += kStepGroup) {
    const std::size_t n = std::min(kStepGroup, steps.size() - begin);
    std::array<std::vector<std::uint64_t>, 3> values;
    std::array<int, 3> widths{};
    for (std::size_t i = begin; i < begin + n; ++i)
      for (std::size_t axis = 0; axis < 3; ++axis) {
        values[axis].push_back(steps[i][axis]);
        widths[axis] = std::max(widths[axis], bitsFor(steps[i][axis]));
      }
    out.u16(static_cast<std::uint16_t>(widths[0] | widths[1] << kStepWidthBits | widths[2] << 2 * kStepWidthBits));
    for (std::size_t axis = 0; axis < 3; ++axis) packBits(out, values[axis], widths[axis]);
  }
  return out.take();
}

TEST(NarrowNodes, AreThoseOfAddingOneByOneOnEveryInstructionSet) {
  std::mt19937_64 random(31);
  for (std::size_t set = 0; set < narrowSets(); ++set)
    for (int round = 0; round < 400; ++round) {
      SCOPED_TRACE("set " + std::to_string(set) + ", round " + std::to_string(round));
      std::vector<ZigzagStep> steps(random() % 100);
      const auto most = static_cast<unsigned>(1 + random() % kNarrowStepBits);
      for (std::size_t i = 0; i < steps.size(); ++i)
        for (std::uint64_t& value : steps[i])
          value = random() % (std::uint64_t{1} << (i % 8 == 0 ? random() % most : most));
      Bytes bytes = encodedSteps(steps);
      const std::size_t size = bytes.size();
      if (round % 2 == 0) bytes.resize(size + random() % 100, 0xff);  // bytes that follow
      std::vector<std::uint16_t> sums(4 * sumsRoom(steps.size()), 7);
      ByteReader in(bytes);
      sumSteps(in, steps.size(), sums.data(), set);
      EXPECT_EQ(in.offset(), size);
      std::array<std::uint16_t, 3> sum{};
      for (std::size_t k = 0; k <= steps.size(); ++k) {
        for (std::size_t axis = 0; axis < 3; ++axis) {
          if (k > 0) sum[axis] = static_cast<std::uint16_t>(sum[axis] + unzigzag(steps[k - 1][axis]));
          ASSERT_EQ(sums[4 * k + axis], sum[axis]) << k;
        }
        ASSERT_EQ(sums[4 * k + 3], 0);
      }
    }
}

TEST(NarrowNodes, RefuseBytesThatEndAndStepsThatAreTooWide) {
  std::mt19937_64 random(32);
  std::vector<ZigzagStep> steps(50);
  for (ZigzagStep& step : steps) step = {random() % 1000, random() % 70000, random() % 5};
  const Bytes good = encodedSteps(steps);
  for (std::size_t set = 0; set < narrowSets(); ++set) {
    std::vector<std::uint16_t> sums(4 * sumsRoom(steps.size()));
    for (std::size_t n = 0; n < good.size(); ++n) {
      ByteReader in(ByteSpan(good).first(n));
      EXPECT_THROW(sumSteps(in, steps.size(), sums.data(), set), Damage) << n;
    }
    for (const unsigned head : {18u, 18u << kStepWidthBits, 31u << 2 * kStepWidthBits, kWideSteps}) {
      Bytes bad = good;
      bad[0] = static_cast<std::uint8_t>(head);
      bad[1] = static_cast<std::uint8_t>(head >> 8);
      ByteReader in(bad);
      EXPECT_THROW(sumSteps(in, steps.size(), sums.data(), set), Damage) << head;
    }
  }
}

TEST(NarrowNodes, MidpointsInABlockAreFoundOnEveryInstructionSet) {
  std::mt19937_64 random(33);
  for (std::size_t set = 0; set < narrowSets(); ++set)
    for (int round = 0; round < 300; ++round) {
      SCOPED_TRACE("set " + std::to_string(set) + ", round " + std::to_string(round));
      const std::size_t nodes = random() % 80;
      std::vector<std::uint16_t> offsets(3 * (nodes + 9));
      for (std::uint16_t& c : offsets) c = static_cast<std::uint16_t>(random() >> (round % 3 * 4 + 48));
      const GridPoint origin(-5000, 7, 1 << 20);
      GridBox box;
      for (int corner = 0; corner < 2; ++corner)
        box.extend(origin + GridPoint(static_cast<std::int64_t>(random() % 90000) - 20000,
                                      static_cast<std::int64_t>(random() % 90000) - 20000,
                                      static_cast<std::int64_t>(random() % 90000) - 20000));
      const NarrowBlock block(box, origin);
      const auto isInside = [&](std::size_t i) {
        bool inside = true;
        for (int axis = 0; axis < 3; ++axis) {
          const auto at = 3 * i + static_cast<std::size_t>(axis);
          const std::int64_t middle = origin[axis] + (offsets[at] + offsets[at + 3]) / 2;
          inside = inside && middle >= box.lo[axis] && middle <= box.hi[axis];
        }
        return inside;
      };
      if (block.empty) {
        for (std::size_t i = 0; i < nodes; ++i) ASSERT_FALSE(isInside(i));
        continue;
      }
      std::vector<std::uint32_t> found;
      findMidpoints(offsets.data(), nodes, block, found, set);
      ASSERT_GE(32 * found.size(), nodes);
      for (std::size_t i = 0; i < nodes; ++i) ASSERT_EQ((found[i / 32] >> (i % 32) & 1) != 0, isInside(i)) << i;
    }
}

}  // namespace
}  // namespace filiform::internal
