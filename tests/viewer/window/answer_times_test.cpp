#include "viewer/window/internal/answer_times.h"

#include <gtest/gtest.h>

namespace filiform::internal {
namespace {

constexpr double kWait_s = 0.002;

// A frame whose poll takes from begin_s to end_s, and which is on the screen at shown_s.
void pass(AnswerTimes& times, double begin_s, double end_s, bool has_events, double shown_s) {
  times.poll(begin_s, end_s, has_events, kWait_s);
  times.presented(shown_s);
  times.endFrame();
}

TEST(AnswerTimes, AnEventThatEndsAWaitCountsFromThere) {
  AnswerTimes times;
  pass(times, 0, 0.015, false, 0.02);
  pass(times, 0.02, 0.03, true, 0.08);
  EXPECT_NEAR(times.longest_ms(), 50, 1e-9);
}

TEST(AnswerTimes, AnEventOfTheFrameBeforeCountsFromItsPoll) {
  AnswerTimes times;
  pass(times, 0, 0.001, false, 0.1);
  pass(times, 0.1, 0.1005, true, 0.15);
  EXPECT_NEAR(times.longest_ms(), 149, 1e-9);
}

TEST(AnswerTimes, AnEventThatChangesNothingIsForgotten) {
  AnswerTimes times;
  pass(times, 0, 0.015, false, 0.02);
  times.poll(0.02, 0.03, true, kWait_s);
  for (int frame = 0; frame < 6; ++frame) times.endFrame();
  pass(times, 1, 1.001, false, 2);
  EXPECT_EQ(times.longest_ms(), 0);
}

TEST(AnswerTimes, WhatComesBeforeTheFirstFrameDoesNotCount) {
  AnswerTimes times;
  pass(times, 0, 0.015, true, 3);
  pass(times, 3, 3.001, false, 3.1);
  EXPECT_EQ(times.longest_ms(), 0);
}

}  // namespace
}  // namespace filiform::internal
