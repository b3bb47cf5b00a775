// The spatial index of skeletons: the files of a box, and the objects of a file.
#include "index/formats/neuroglancer/internal/spatial_index.h"

#include "index/errors.h"
#include "tests/support/what_of.h"

#include <algorithm>
#include <limits>
#include <string>
#include <vector>

#include <gtest/gtest.h>

namespace filiform {
namespace {

using Names = std::vector<std::string>;

const char* const kSkeletons = R"({"@type": "neuroglancer_skeletons", "mip": 1,
    "spatial_index": {"chunk_size": [1000, 1000, 400], "resolution": [16, 16, 40]}})";
const char* const kVolume = R"({"type": "segmentation", "scales": [
    {"resolution": [8, 8, 40], "size": [300, 200, 30], "voxel_offset": [20, 0, 0]},
    {"resolution": [16, 16, 40], "size": [150, 100, 30], "voxel_offset": [10, 0, 0]}]})";

Names filesIn(const Box_nm& box, const std::string& skeletons = kSkeletons, const std::string& volume = kVolume) {
  Names names = SpatialIndex(skeletons, "skeletons/info", volume, "volume/info").filesIn(box);
  std::sort(names.begin(), names.end());
  return names;
}

TEST(SpatialIndex, ABoxNamesTheChunksThatItMeets) {
  EXPECT_EQ(filesIn({{{200, 10, 10}, {300, 20, 20}}}), (Names{"160-1160_0-1000_0-400.spatial"}));
  EXPECT_EQ(filesIn({{{1000, 1500, 500}, {1200, 1550, 900}}}),
            (Names{"1160-2160_1000-1600_400-800.spatial", "1160-2160_1000-1600_800-1200.spatial",
                   "160-1160_1000-1600_400-800.spatial", "160-1160_1000-1600_800-1200.spatial"}))
      << "the last chunk ends where the volume ends";
  const double far = std::numeric_limits<double>::infinity();
  EXPECT_EQ(filesIn({{{-far, -far, -far}, {far, far, far}}}).size(), 3u * 2 * 3);
  EXPECT_EQ(filesIn({{{-900, 0, 0}, {159, 9, 9}}}), Names{}) << "before the volume";
  EXPECT_EQ(filesIn({{{2560.5, 0, 0}, {9000, 9, 9}}}), Names{}) << "behind it";
}

TEST(SpatialIndex, NamesHaveTheDecimalsOfTheResolution) {
  const std::string volume = R"({"scales": [{"resolution": [4.5, 4, 40.25], "size": [3, 5, 2]}]})";
  const std::string skeletons = R"({"spatial_index": {"chunk_size": [9, 8, 161]}})";
  EXPECT_EQ(filesIn({{{10, 9, 0}, {11, 9, 1}}}, skeletons, volume),
            (Names{"9.00-13.50_8.00-16.00_0.00-80.50.spatial"}));
}

TEST(SpatialIndex, WhatIsNotStatedIsSaid) {
  const Box_nm box{{{0, 0, 0}, {1, 1, 1}}};
  EXPECT_NE(test::whatOf<InputError>([&] { filesIn(box, "{}"); }).find("skeletons/info: names no spatial_index"),
            std::string::npos);
  EXPECT_NE(test::whatOf<InputError>([&] {
              filesIn(box, R"({"spatial_index": {"chunk_size": [0, 1, 1]}})");
            }).find("no chunk_size"),
            std::string::npos);
  EXPECT_NE(test::whatOf<InputError>([&] { filesIn(box, kSkeletons, "[]"); }).find("volume/info: states no scale"),
            std::string::npos);
  const double far = std::numeric_limits<double>::infinity();
  EXPECT_NE(
      test::whatOf<InputError>([&] {
        filesIn({{{-far, -far, -far}, {far, far, far}}}, R"({"spatial_index": {"chunk_size": [1, 1, 1]}})", kVolume);
      }).find("too many chunks"),
      std::string::npos);
}

TEST(SpatialIndex, ObjectsOfAFileAreThoseInTheBox) {
  std::vector<std::uint64_t> ids;
  const Box_nm box{{{0, 0, 0}, {100, 100, 100}}};
  SpatialIndex::objectsIn(box, R"({"18446744073709551615": [100, 0, 0, 200, 1, 1], "7": [101, 0, 0, 102, 1, 1],
      "8": [-50, -50, -50, 500, 500, 500]})",
                          "x.spatial", ids);
  std::sort(ids.begin(), ids.end());
  EXPECT_EQ(ids, (std::vector<std::uint64_t>{8, UINT64_MAX}));
  for (const char* const bad : {"[]", R"({"x": [0, 0, 0, 1, 1, 1]})", R"({"7": [0, 0, 0, 1, 1]})", R"({"7": 3})", "{"})
    EXPECT_NE(
        test::whatOf<InputError>([&] { SpatialIndex::objectsIn(box, bad, "x.spatial", ids); }).find("x.spatial: "),
        std::string::npos)
        << bad;
}

}  // namespace
}  // namespace filiform
