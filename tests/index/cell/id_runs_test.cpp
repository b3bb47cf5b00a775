#include "index/cell/id_runs.h"

#include "index/set/internal/cells_file.h"

#include <cstdint>
#include <vector>

#include <gtest/gtest.h>

namespace filiform {
namespace {

TEST(IdRuns, AnswersAsTheListOfIds) {
  for (const std::vector<std::int64_t>& ids :
       {std::vector<std::int64_t>{}, {7}, {1, 2, 3}, {3, 4, 9, 10, 2, 3, 4}, {INT64_MAX, INT64_MIN, INT64_MIN + 1}}) {
    const IdRuns runs(ids);
    EXPECT_EQ(runs.all(), ids);
    ASSERT_EQ(runs.size(), ids.size());
    for (std::uint32_t rank = 0; rank < ids.size(); ++rank) {
      EXPECT_EQ(runs[rank], ids[rank]);
      std::vector<std::uint32_t> ranks;
      for (std::uint32_t i = 0; i < ids.size(); ++i)
        if (ids[i] == ids[rank]) ranks.push_back(i);
      EXPECT_EQ(runs.ranksOf(ids[rank]), ranks);
    }
    EXPECT_TRUE(runs.ranksOf(100).empty());
  }
}

TEST(IdRuns, ARunOfTwoToThe32IdsTakesTheMemoryOfOneRun) {
  CellDetail detail;
  detail.sample_ids.add(-5, UINT32_MAX - 1);
  const internal::Bytes bytes = internal::encodeDetail(detail);
  EXPECT_LT(bytes.size(), 20u);
  const CellDetail back = internal::decodeDetail(bytes, UINT32_MAX - 1);
  EXPECT_EQ(back.sample_ids, detail.sample_ids);
  EXPECT_EQ(back.sample_ids[UINT32_MAX - 2], std::int64_t{UINT32_MAX} - 7);
  EXPECT_EQ(back.sample_ids.runs().size(), 1u);
}

TEST(IdRuns, ListsOfTilesAreReadWithoutTheBytesBehindThem) {
  CellDetail detail;
  detail.tiles = {2, 3, 70000};
  internal::Bytes bytes = internal::encodeDetail(detail);
  bytes.resize(bytes.size() - 3);
  bytes.insert(bytes.end(), {0xff, 0xff, 0xff});
  EXPECT_EQ(internal::decodeTiles(bytes), detail.tiles);
  EXPECT_THROW(internal::decodeDetail(bytes, 0), internal::Damage);
  // A number of tiles beyond the bytes.
  EXPECT_THROW(internal::decodeTiles(internal::Bytes{0xff, 0xff, 0xff, 0xff, 0x0f, 1, 1}), internal::Damage);
  EXPECT_THROW(internal::withTiles(internal::Bytes{0xff, 0xff, 0xff, 0xff, 0x0f, 1, 1}, [](auto&) {}),
               internal::Damage);
}

}  // namespace
}  // namespace filiform
