// The budget of frames follows their time, whatever draws them: tried with renderers of constant speed.
#include "viewer/gl/frame_governor.h"

#include <algorithm>
#include <cmath>
#include <vector>

#include <gtest/gtest.h>

namespace filiform {
namespace {

// A renderer that takes `us` for a segment with one sample, and five times as much with all of them.
SceneFigures draw(const FrameGovernor& governor, bool moving, double us) {
  const SceneBudget& budget = governor.budget();
  SceneFigures figures;
  figures.redrawn = true;
  figures.moving = moving;
  figures.limited = true;
  figures.segments = moving ? budget.moving_segments : budget.segments;
  const int samples = moving ? budget.moving_samples : budget.samples;
  figures.samples = samples;
  figures.picture_ms = 1e-3 * us * static_cast<double>(figures.segments) * (samples > 1 ? 5 : 1);
  return figures;
}

TEST(FrameGovernors, MotionKeepsItsTimeAtAnySpeed) {
  for (const double us : {1e-3, 0.1, 1.5, 10.0}) {
    FrameGovernor governor;
    double ms = 0;
    for (int i = 0; i < 60; ++i) {
      const SceneFigures figures = draw(governor, true, us);
      governor.drew(figures);
      ms = figures.picture_ms;
    }
    EXPECT_LE(ms, 2 * FrameGovernor::kMoving_ms) << us;
    if (us > 1) {
      EXPECT_GE(ms, FrameGovernor::kMoving_ms / 4) << us;
    }
    if (us < 0.01) {
      EXPECT_EQ(governor.budget().moving_samples, governor.budget().samples) << us;
    }
  }
}

// A picture of which a part is wrong by many pixels uses kCoarse_ms, a good one kMoving_ms.
TEST(FrameGovernors, CoarsePicturesInMotionHaveMoreTime) {
  constexpr double kUs = 2;
  for (const double error_px : {30.0, 1.0}) {
    FrameGovernor governor;
    std::vector<double> times;
    for (int i = 0; i < 200; ++i) {
      SceneFigures figures = draw(governor, true, kUs);
      figures.error_px = error_px;
      governor.drew(figures);
      if (i > 20) times.push_back(figures.picture_ms);
    }
    const double most_ms = error_px > FrameGovernor::kGood_px ? FrameGovernor::kCoarse_ms : FrameGovernor::kMoving_ms;
    EXPECT_LE(*std::max_element(times.begin(), times.end()), most_ms);
    EXPECT_GE(*std::min_element(times.begin(), times.end()), most_ms / 2) << error_px;
  }
}

// Tiles are large: a budget that is little used may still be too small for finer ones.
TEST(FrameGovernors, ABudgetThatIsTooSmallForFinerTilesGrows) {
  FrameGovernor governor(2'000'000);
  SceneFigures figures = draw(governor, true, 0.1);
  figures.segments = 300;
  figures.picture_ms = 15;
  figures.error_px = 200;
  for (int i = 0; i < 40; ++i) governor.drew(figures);
  EXPECT_GT(governor.budget().moving_segments, 1'000'000u);
}

TEST(FrameGovernors, SmallOrManyPixelsHaveOneSample) {
  const FrameGovernor governor;
  EXPECT_EQ(governor.budgetFor({1280, 800}, 1).samples, governor.budget().samples);
  EXPECT_EQ(governor.budgetFor({1280, 800}, 1.5).samples, governor.budget().samples);
  EXPECT_EQ(governor.budgetFor({2560, 1600}, 2).samples, 1);
  EXPECT_EQ(governor.budgetFor({8192, 8192}, 1).samples, 1);
  EXPECT_EQ(governor.budgetFor({8192, 8192}, 1).moving_samples, 1);
}

TEST(FrameGovernors, RestGrowsAndShrinksInMotionOnly) {
  FrameGovernor fast, slow;
  for (int i = 0; i < 10; ++i) fast.drew(draw(fast, false, 0.01));
  EXPECT_EQ(fast.budget().segments, FrameGovernor::kMostSegments);
  const std::uint64_t first = slow.budget().segments;
  for (int i = 0; i < 10; ++i) slow.drew(draw(slow, false, 10));
  EXPECT_EQ(slow.budget().segments, first);
  slow.drew(draw(slow, true, 10));
  EXPECT_LT(slow.budget().segments, first);
}

TEST(FrameGovernors, AfterALatePictureInMotionTheNextOneIsInTime) {
  FrameGovernor governor;
  int late = 0;
  for (SceneFigures figures = draw(governor, true, 10); figures.picture_ms > FrameGovernor::kLate_ms; ++late) {
    ASSERT_LT(late, 3);
    governor.drew(figures);
    figures = draw(governor, true, 10);
  }
  EXPECT_GT(late, 0);
  for (int i = 0; i < 20; ++i) governor.drew(draw(governor, true, 1000));
  EXPECT_EQ(governor.budget().moving_segments, FrameGovernor::kLeastSegments);
}

// Few cones that cover the picture: their time is that of their pixels.
TEST(FrameGovernors, LargerPixelsStayWhileTheyAreNeeded) {
  FrameGovernor governor;
  SceneFigures figures = draw(governor, false, 0.1);
  figures.segments = 1000;
  figures.picture_ms = 20'000;
  governor.drew(figures);
  EXPECT_EQ(governor.budget().moving_stretch, 8);
  double full_ms = 1000;  // of a picture in motion with the screen's pixels
  const auto move = [&] {
    figures = draw(governor, true, 0);
    figures.segments = 1000;
    figures.stretch = governor.budget().moving_stretch;
    figures.picture_ms = full_ms / (figures.stretch * figures.stretch);
    governor.drew(figures);
  };
  for (int i = 0; i < 20; ++i) move();
  EXPECT_LE(figures.picture_ms, FrameGovernor::kMoving_ms);
  EXPECT_EQ(governor.budget().moving_stretch, 8);
  full_ms = 30;
  for (int i = 0; i < 20; ++i) move();
  EXPECT_EQ(governor.budget().moving_stretch, 1);
  // The scene view had to draw a picture again with larger pixels.
  figures.samples = 1;
  figures.stretch = 4;
  governor.drew(figures);
  EXPECT_EQ(governor.budget().moving_stretch, 4);
}

TEST(FrameGovernors, APictureAtRestTellsWhatMotionCosts) {
  FrameGovernor governor;
  governor.drew(draw(governor, false, 5));
  EXPECT_LE(draw(governor, true, 5).picture_ms, FrameGovernor::kLate_ms);
}

TEST(FrameGovernors, WhatTheUserAsksForIsKeptAtRest) {
  FrameGovernor governor(2'000'000);
  for (int i = 0; i < 10; ++i) {
    governor.drew(draw(governor, false, 10));
    governor.drew(draw(governor, true, 10));
  }
  EXPECT_EQ(governor.budget().segments, 2'000'000u);
  EXPECT_LT(governor.budget().moving_segments, 50'000u);
}

}  // namespace
}  // namespace filiform
