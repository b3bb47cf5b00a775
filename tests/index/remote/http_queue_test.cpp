#include "index/remote/internal/http_queue.h"

#include "index/remote/internal/background_reads.h"

#include <algorithm>
#include <thread>

#include <gtest/gtest.h>

namespace filiform {
namespace {

using internal::HttpJob;
using internal::HttpQueue;

class HttpQueueTest : public ::testing::Test {
 protected:
  HttpJob range(const std::string& url, std::uint64_t offset, std::uint64_t size) {
    return {.kind = HttpJob::Kind::range, .url = url, .offset = offset, .bytes = {bytes_.data(), size}};
  }
  static std::vector<std::uint64_t> offsets(std::vector<HttpJob*> jobs) {
    std::vector<std::uint64_t> all;
    for (const HttpJob* job : jobs) all.push_back(job->offset);
    std::sort(all.begin(), all.end());
    return all;
  }
  std::vector<std::uint8_t> bytes_ = std::vector<std::uint8_t>(8 << 20);
  const HttpJob::Clock::time_point now_ = HttpJob::Clock::now();
};

TEST_F(HttpQueueTest, NearRangesOfOneFileGoTogether) {
  HttpJob a = range("f", 100'000, 1000), b = range("f", 101'000, 1000), c = range("f", 90'000, 5000),
          far = range("f", 200'000, 10), other = range("g", 101'000, 1000), whole{.kind = HttpJob::Kind::whole};
  HttpQueue queue;
  for (HttpJob* job : {&a, &far, &other, &whole, &c, &b}) queue.add(*job);
  EXPECT_EQ(offsets(queue.take(now_)), (std::vector<std::uint64_t>{90'000, 100'000, 101'000}));
  EXPECT_EQ(queue.take(now_), std::vector<HttpJob*>{&far});
  EXPECT_EQ(queue.take(now_), std::vector<HttpJob*>{&other});
  EXPECT_EQ(queue.take(now_), std::vector<HttpJob*>{&whole});
  EXPECT_TRUE(queue.empty());
  EXPECT_TRUE(queue.take(now_).empty());
}

TEST_F(HttpQueueTest, FromFarAwayWiderGapsAreWorthNoSecondRequest) {
  constexpr std::uint64_t kGap = 4 * HttpQueue::kMostGap;
  const auto together = [&](double latency_s, std::uint64_t gap) {
    HttpJob a = range("f", 0, 1000), b = range("f", 1000 + gap, 1000);
    HttpQueue queue;
    queue.setLatency(latency_s);
    queue.add(a);
    queue.add(b);
    return queue.take(now_).size() == 2;
  };
  EXPECT_FALSE(together(0.001, kGap));
  EXPECT_FALSE(together(0.02, kGap));
  EXPECT_TRUE(together(0.15, kGap));
  EXPECT_FALSE(together(10, 4 * kGap)) << "bounded";
}

TEST_F(HttpQueueTest, ARequestStaysSmallAndALargeRangeGoes) {
  std::vector<HttpJob> jobs;
  constexpr std::uint64_t kPiece = 1 << 20;
  for (std::uint64_t i = 0; i < 10; ++i) jobs.push_back(range("f", i * kPiece, kPiece));
  HttpQueue queue;
  for (HttpJob& job : jobs) {
    job.background = true;
    queue.add(job);
  }
  EXPECT_EQ(queue.take(now_).size(), HttpQueue::kMostMerged / kPiece);
  std::vector<HttpJob> tiles;
  for (std::uint64_t i = 0; i < 100; ++i) tiles.push_back(range("g", i * 10'000, 10'000));
  for (HttpJob& job : tiles) queue.add(job);
  EXPECT_EQ(queue.take(now_).size(), HttpQueue::kMostUrgent / 10'000);
  HttpJob large = range("h", 0, 8 << 20);
  HttpQueue one;
  one.add(large);
  EXPECT_EQ(one.take(now_).size(), 1u);
}

TEST_F(HttpQueueTest, AJobWaitsForItsTime) {
  HttpJob late = range("f", 0, 10), alone = range("f", 10, 10), ready = range("f", 20, 10);
  late.not_before = now_ + std::chrono::seconds(5);
  alone.alone = true;
  HttpQueue queue;
  for (HttpJob* job : {&late, &alone, &ready}) queue.add(*job);
  EXPECT_EQ(queue.take(now_), std::vector<HttpJob*>{&alone});
  EXPECT_EQ(queue.take(now_), std::vector<HttpJob*>{&ready});
  EXPECT_TRUE(queue.take(now_).empty());
  EXPECT_EQ(queue.nextReady(), late.not_before);
  EXPECT_EQ(queue.take(late.not_before), std::vector<HttpJob*>{&late});
  EXPECT_FALSE(queue.nextReady());
}

TEST_F(HttpQueueTest, AJobThatGathersGoesWithItsNeighbours) {
  HttpJob first = range("f", 0, 10), second = range("f", 10, 10), far = range("f", 1'000'000, 10);
  for (HttpJob* job : {&first, &second, &far}) job->gathering = true;
  first.not_before = now_ + std::chrono::milliseconds(1);
  second.not_before = far.not_before = now_ + std::chrono::milliseconds(2);
  HttpQueue queue;
  for (HttpJob* job : {&first, &second, &far}) queue.add(*job);
  EXPECT_TRUE(queue.take(now_).empty());
  EXPECT_EQ(offsets(queue.take(first.not_before)), (std::vector<std::uint64_t>{0, 10}));
  EXPECT_EQ(queue.nextReady(), far.not_before);
  EXPECT_EQ(queue.take(far.not_before), std::vector<HttpJob*>{&far});
}

TEST_F(HttpQueueTest, TheBackgroundComesLastAndAlone) {
  HttpJob bulk = range("f", 0, 10), more = range("f", 10, 10), urgent = range("f", 20, 10);
  bulk.background = more.background = true;
  HttpQueue queue;
  for (HttpJob* job : {&bulk, &more, &urgent}) queue.add(*job);
  EXPECT_EQ(queue.take(now_, false), std::vector<HttpJob*>{&urgent});
  EXPECT_TRUE(queue.take(now_, false).empty());
  EXPECT_FALSE(queue.nextReady(false)) << "a thread that may not start them must not wake for them";
  EXPECT_TRUE(queue.nextReady());
  queue.add(urgent);
  EXPECT_EQ(queue.take(now_), std::vector<HttpJob*>{&urgent});
  EXPECT_EQ(offsets(queue.take(now_)), (std::vector<std::uint64_t>{0, 10}));
}

TEST(BackgroundReads, LastAsLongAsTheObject) {
  using internal::BackgroundReads;
  EXPECT_FALSE(BackgroundReads::active());
  {
    const BackgroundReads bulk;
    EXPECT_TRUE(BackgroundReads::active());
    {
      const BackgroundReads not_now(false);
      EXPECT_FALSE(BackgroundReads::active());
    }
    EXPECT_TRUE(BackgroundReads::active());
    std::thread([] { EXPECT_FALSE(BackgroundReads::active()) << "of one thread"; }).join();
  }
  EXPECT_FALSE(BackgroundReads::active());
}

}  // namespace
}  // namespace filiform
