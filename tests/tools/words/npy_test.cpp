// Arrays in .npy: what NumPy writes is read; everything else is refused.
#include "tools/words/npy.h"

#include "tests/support/servers/served_sets.h"
#include "tools/words/refusal.h"

#include <random>
#include <string>

#include <gtest/gtest.h>

namespace filiform::tools {
namespace {

std::string npyArray(const std::string& dictionary, const std::string& data, char version = 1) {
  std::string bytes("\x93NUMPY", 6);
  bytes += {version, '\0', static_cast<char>(dictionary.size()), '\0'};
  if (version == 2) bytes += std::string(2, '\0');
  return bytes + dictionary + data;
}

unsigned statusOfNpy(const std::string& bytes) {
  try {
    readNpyPoints(bytes, 10);
    return 200;
  } catch (const Refusal& refusal) {
    return refusal.status();
  }
}

TEST(Npy, PointsOfBothOrdersAndTypesAreRead) {
  const std::vector<Vector3d> points{{1, 2, 3}, {-4, 5.5, 6e9}};
  EXPECT_EQ(readNpyPoints(test::npyOf(points), 2), points);
  const float columns[] = {1, -4, 2, 5.5, 3, 7};
  const std::string data(reinterpret_cast<const char*>(columns), sizeof columns);
  const auto read = readNpyPoints(npyArray("{'descr': '<f4', 'fortran_order': True, 'shape': (2, 3), }\n", data, 2), 2);
  ASSERT_EQ(read.size(), 2u);
  EXPECT_EQ(read[1], Vector3d(-4, 5.5, 7));
  const auto one =
      readNpyPoints(npyArray("{\"shape\":(3,),\"fortran_order\":True,\"descr\":\"<f4\"}", data.substr(0, 12)), 1);
  EXPECT_EQ(one, (std::vector<Vector3d>{{1, -4, 2}}));
  EXPECT_TRUE(readNpyPoints(test::npyOf({}), 0).empty());
}

TEST(Npy, OtherArraysAreRefused) {
  const std::string data(48, '\0');
  const auto of = [&](const std::string& dictionary) { return statusOfNpy(npyArray(dictionary, data)); };
  EXPECT_EQ(of("{'descr': '<f8', 'fortran_order': False, 'shape': (2, 3)}"), 200u);
  EXPECT_EQ(of("{'descr': '>f8', 'fortran_order': False, 'shape': (2, 3)}"), 400u);
  EXPECT_EQ(of("{'descr': '|O', 'fortran_order': False, 'shape': (2, 3)}"), 400u);
  EXPECT_EQ(of("{'descr': '<f8', 'fortran_order': False, 'shape': (3, 2)}"), 400u);
  EXPECT_EQ(of("{'descr': '<f8', 'fortran_order': False, 'shape': (1, 3)}"), 400u) << "bytes after the array";
  EXPECT_EQ(of("{'descr': '<f8', 'fortran_order': False, 'shape': (3, 3)}"), 400u) << "too short";
  EXPECT_EQ(of("{'descr': '<f8', 'fortran_order': False}"), 400u);
  EXPECT_EQ(of("{'descr': '<f8', 'descr': '<f8', 'fortran_order': False, 'shape': (2, 3)}"), 400u);
  EXPECT_EQ(of("{'descr': '<f8', 'fortran_order': False, 'shape': (18446744073709551615, 3)}"), 413u);
  EXPECT_EQ(of("{'descr': '<f8', 'fortran_order': False, 'shape': (11, 3)}"), 413u);
  EXPECT_EQ(of("{'descr': '<f8', 'fortran_order': 1, 'shape': (2, 3)}"), 400u);
  EXPECT_EQ(of("{'descr': '<f8"), 400u);
  EXPECT_EQ(statusOfNpy(""), 400u);
  EXPECT_EQ(statusOfNpy("PK\x03\x04 not an array"), 400u);
}

TEST(Npy, DamagedArraysNeverReadPastTheirEnd) {
  std::mt19937_64 random(17);
  const std::string whole = test::npyOf({{1, 2, 3}, {4, 5, 6}});
  for (int i = 0; i < 20000; ++i) {
    std::string bytes = whole;
    for (int change = static_cast<int>(random() % 4); change >= 0; --change)
      bytes[random() % bytes.size()] = static_cast<char>(random());
    if (random() % 3 == 0) bytes.resize(random() % bytes.size());
    const unsigned status = statusOfNpy(std::string(bytes));
    EXPECT_TRUE(status == 200 || status == 400 || status == 413);
  }
}

TEST(Npy, TheHeaderEndsAtAMultipleOf64) {
  for (const std::size_t rows : {0u, 7u, 1000000u}) {
    const std::string header = npyHeader("[('x', '<f8')]", rows);
    EXPECT_EQ(header.size() % 64, 0u);
    EXPECT_EQ(header.back(), '\n');
    EXPECT_NE(header.find("'shape': (" + std::to_string(rows) + ",)"), std::string::npos);
  }
}

}  // namespace
}  // namespace filiform::tools
