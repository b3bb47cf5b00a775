#include "index/remote/internal/answer_watch.h"

#include <gtest/gtest.h>

namespace filiform::internal {
namespace {

using std::chrono::milliseconds;
using std::chrono::seconds;

class AnswerWatchTest : public testing::Test {
 protected:
  RemoteCounters at(AnswerWatch::Clock::duration time) const {
    RemoteCounters counters;
    watch.describe(counters, begin + time);
    return counters;
  }
  AnswerWatch watch;
  const AnswerWatch::Clock::time_point begin{seconds(1000)};
};

TEST_F(AnswerWatchTest, IsNotSilentWithoutReads) {
  EXPECT_EQ(at(seconds(5)).silent_s, 0);
  watch.readBegins(begin);
  watch.answered(begin, begin + seconds(1));
  watch.readEnds();
  EXPECT_EQ(at(seconds(9)).silent_s, 0);
  EXPECT_FALSE(at(seconds(9)).lost);
}

TEST_F(AnswerWatchTest, CountsFromTheReadOrTheLastAnswer) {
  watch.readBegins(begin);
  watch.readBegins(begin + seconds(2));
  EXPECT_DOUBLE_EQ(at(seconds(3)).silent_s, 3);
  watch.answered(begin, begin + seconds(4));
  watch.readEnds();
  EXPECT_DOUBLE_EQ(at(seconds(5)).silent_s, 1);
  EXPECT_FALSE(at(seconds(5)).lost);
}

TEST_F(AnswerWatchTest, IsLostFromAFailureToTheNextAnswer) {
  watch.readBegins(begin);
  watch.unanswered(begin + seconds(1));
  EXPECT_TRUE(at(seconds(2)).lost);
  watch.readEnds();
  watch.readBegins(begin + seconds(3));
  EXPECT_DOUBLE_EQ(at(seconds(4)).silent_s, 4) << "since the first read without an answer";
  watch.answered(begin + seconds(3), begin + seconds(5));
  EXPECT_FALSE(at(seconds(5)).lost);
  EXPECT_DOUBLE_EQ(at(milliseconds(5500)).silent_s, 0.5);
}

TEST_F(AnswerWatchTest, AnAnswerToAnEarlierRequestDoesNotEndTheLoss) {
  watch.readBegins(begin);
  watch.readBegins(begin);
  watch.unanswered(begin + seconds(1));
  watch.answered(begin, begin + seconds(2));
  EXPECT_TRUE(at(seconds(3)).lost);
  watch.answered(begin + seconds(2), begin + seconds(3));
  EXPECT_FALSE(at(seconds(3)).lost);
}

TEST_F(AnswerWatchTest, ForgetsAFailureThatNothingRepeats) {
  watch.readBegins(begin);
  watch.unanswered(begin + seconds(1));
  watch.readEnds();
  EXPECT_TRUE(at(seconds(12)).lost);
  EXPECT_FALSE(at(seconds(14)).lost);
  EXPECT_EQ(at(seconds(14)).silent_s, 0);
}

}  // namespace
}  // namespace filiform::internal
