// Points in JSON: what is read, and what is refused.
#include "tools/serve/routes/point_list.h"

#include "tools/words/refusal.h"

#include <string>

#include <gtest/gtest.h>

namespace filiform::tools {
namespace {

unsigned statusOfList(const std::string& json) {
  try {
    readPointList(json, 2);
    return 200;
  } catch (const Refusal& refusal) {
    return refusal.status();
  }
}

TEST(PointList, PointsAndNumbersAreRead) {
  const PointList list =
      readPointList(R"({"k": 3, "points": [[1, -2.5, 3e2], [0, 0, 18446744073709551615]], "epsilon": 0.5})", 2);
  EXPECT_EQ(list.points, (std::vector<Vector3d>{{1, -2.5, 300}, {0, 0, 18446744073709551615.0}}));
  EXPECT_EQ(list.numbers, (std::map<std::string, double>{{"epsilon", 0.5}, {"k", 3}}));
  EXPECT_TRUE(readPointList(R"({"points": []})", 0).points.empty());
}

TEST(PointList, OtherJsonIsRefused) {
  for (const char* json : {"",
                           "{",
                           "[]",
                           "1",
                           "null",
                           "[[1,2,3]]",
                           "{}",
                           R"({"k": 2})",
                           R"({"points": 1})",
                           R"({"points": [1,2,3]})",
                           R"({"points": [[1,2]]})",
                           R"({"points": [[1,2,3,4]]})",
                           R"({"points": [[1,2,"3"]]})",
                           R"({"points": [[[1,2,3]]]})",
                           R"({"points": {}})",
                           R"({"points": [], "points": []})",
                           R"({"k": [1]})",
                           R"({"k": null})",
                           R"({"k": {"a": 1}})",
                           R"({"points": [[1,2,null]]})",
                           R"({"points": [[1,2,1e999]]})",
                           R"({"points": []} x)",
                           "{\"points\": [[1,2,\xff]]}"})
    EXPECT_EQ(statusOfList(json), 400u) << json;
  EXPECT_EQ(statusOfList(R"({"points": [[1,2,3],[1,2,3],[1,2,3]]})"), 413u);
  EXPECT_EQ(statusOfList(std::string(1 << 20, '[')), 400u);
  EXPECT_EQ(statusOfList(R"({"points": )" + std::string(1 << 20, '[')), 400u);
}

}  // namespace
}  // namespace filiform::tools
