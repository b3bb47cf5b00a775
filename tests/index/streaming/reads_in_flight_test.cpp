#include "index/streaming/internal/reads_in_flight.h"

#include <gtest/gtest.h>

namespace filiform::internal {
namespace {

void addWindow(ReadsInFlight& reads, double s) {
  for (int i = 0; i < 16; ++i) reads.add(s);
}

TEST(ReadsInFlightTest, ReadsThatWaitForEachOtherBecomeFewer) {
  ReadsInFlight reads(8, 64);
  EXPECT_EQ(reads.most(), 64U);
  EXPECT_EQ(reads.fastest_s(), 0) << "not known";
  addWindow(reads, 0.15);
  EXPECT_DOUBLE_EQ(reads.fastest_s(), 0.15);
  for (int i = 0; i < 4; ++i) addWindow(reads, 0.6);
  EXPECT_LT(reads.most(), 32U);
  for (int i = 0; i < 100; ++i) addWindow(reads, 0.15);
  EXPECT_EQ(reads.most(), 64U);
}

TEST(ReadsInFlightTest, HitsOfACacheDoNotMakeASourceNear) {
  ReadsInFlight reads(8, 64);
  for (int window = 0; window < 20; ++window) {
    reads.add(0.0001);
    for (int i = 0; i < 15; ++i) reads.add(0.15);
  }
  EXPECT_EQ(reads.most(), 64U);
  EXPECT_DOUBLE_EQ(reads.fastest_s(), 0.15);
}

TEST(ReadsInFlightTest, ASourceNearbyNeedsTheLeast) {
  ReadsInFlight reads(8, 64);
  for (int i = 0; i < 100; ++i) addWindow(reads, 0.001);
  EXPECT_EQ(reads.most(), 8U);
}

}  // namespace
}  // namespace filiform::internal
