#include "index/ranks/rank_points.h"

#include "index/errors.h"
#include "tests/support/scenes/thread_ranks.h"

#include <random>
#include <string>
#include <vector>

#include <gtest/gtest.h>

namespace filiform::tools {
namespace {

using test::onRanks;

std::string lettersOf(const Vector3d& p) { return p.x() < 0 ? "" : std::string(static_cast<std::size_t>(p.x()), 'x'); }

TEST(RankPoints, RankZeroGetsTheTextsInTheOrderOfThePoints) {
  std::mt19937 random(1);
  std::uniform_real_distribution<double> um(-50, 100);
  for (const std::size_t count : {0u, 1u, 2u, 500u})
    for (const unsigned ranks : {1u, 2u, 3u, 5u}) {
      std::vector<Vector3d> points(count);
      for (Vector3d& p : points) p = Vector3d(um(random), um(random), um(random));
      std::vector<std::string> gathered;
      std::vector<std::size_t> parts(ranks);
      const auto thrown = onRanks(ranks, [&](Ranks& job) {
        const bool is_first = job.rank() == 0;
        RankPoints together(job);
        EXPECT_EQ(together.ofFirst(is_first ? count : 77), count);
        const PointPart part =
            together.deal(Grid(), is_first ? std::span<const Vector3d>(points) : std::span<const Vector3d>());
        parts[job.rank()] = part.points.size();
        std::vector<std::string> texts;
        for (std::size_t i = 0; i < part.points.size(); ++i) {
          EXPECT_EQ(part.points[i], points[part.positions[i]]);
          texts.push_back(lettersOf(part.points[i]));
        }
        std::vector<std::string> got = together.gather(part, texts);
        if (is_first)
          gathered = std::move(got);
        else
          EXPECT_TRUE(got.empty());
      });
      for (const std::exception_ptr& error : thrown) EXPECT_FALSE(error);
      ASSERT_EQ(gathered.size(), count);
      for (std::size_t i = 0; i < count; ++i) EXPECT_EQ(gathered[i], lettersOf(points[i])) << i;
      for (const std::size_t part : parts) EXPECT_LE(part, count / ranks + 1);
    }
}

TEST(RankPoints, ARankWithAnotherSetFailsByName) {
  for (unsigned odd = 1; odd < 3; ++odd) {
    const auto thrown = onRanks(3, [&](Ranks& job) {
      RankPoints(job).compare("a.fil", job.rank() == odd ? "r-2" : "r-1");
      ADD_FAILURE() << "rank " << job.rank() << " goes on";
    });
    for (unsigned r = 0; r < 3; ++r) {
      ASSERT_TRUE(thrown[r]) << r;
      try {
        std::rethrow_exception(thrown[r]);
      } catch (const RankFailed& error) {
        EXPECT_EQ(error.rank(), odd);
      } catch (const IoError& error) {
        EXPECT_EQ(r, odd);
        EXPECT_EQ(error.what(), std::string("a.fil: is r-2 here, and r-1 on rank 0; run the command again"));
      }
    }
  }
}

}  // namespace
}  // namespace filiform::tools
