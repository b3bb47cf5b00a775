#include "tests/support/golden.h"

#include "tests/support/temp_folder.h"
#include "tools/pictures/png.h"

#include <algorithm>
#include <random>

#include <gtest/gtest.h>

namespace filiform::test {
namespace {

// Slanting lines two pixels wide on a dark ground.
Picture threads(int shift, int width = 120, int height = 80) {
  Picture p{width, height, std::vector<std::uint8_t>(static_cast<std::size_t>(3 * width * height), 14)};
  for (int line = 0; line < 5; ++line)
    for (int y = 0; y < height; ++y)
      for (int wide = 0; wide < 2; ++wide) {
        const int x = 12 + 20 * line + y / 4 + wide + shift;
        if (x >= 0 && x < width)
          p.rgb[static_cast<std::size_t>(3 * (y * width + x) + line % 3)] = static_cast<std::uint8_t>(120 + 20 * line);
      }
  return p;
}

TEST(Golden, WhatAnotherDriverRoundsIsTheSame) {
  Picture noisy = threads(0);
  std::mt19937 random(1);
  for (std::uint8_t& c : noisy.rgb) c = static_cast<std::uint8_t>(c + random() % 5 - 2);
  EXPECT_TRUE(compare(threads(0), noisy).showsTheSame());
  // In every 20th row the edges of the lines fall on the neighbouring pixel.
  Picture edges = threads(0);
  for (int y = 0; y < 80; y += 20)
    for (int x = 118; x > 0; --x)
      for (int c = 0; c < 3; ++c)
        edges.rgb[static_cast<std::size_t>(3 * (y * 120 + x) + c)] =
            edges.rgb[static_cast<std::size_t>(3 * (y * 120 + x - 1) + c)];
  EXPECT_TRUE(compare(threads(0), edges).showsTheSame());
}

TEST(Golden, WrongPicturesAreNot) {
  const Picture right = threads(0);
  EXPECT_FALSE(compare(right, threads(3)).showsTheSame());
  EXPECT_FALSE(compare(right, threads(0, 119)).showsTheSame());
  Picture dark = right, mirrored = right, recoloured = right, without = right;
  for (std::uint8_t& c : dark.rgb) c = static_cast<std::uint8_t>(c * 3 / 4);
  for (int y = 0; y < 80; ++y)
    for (int x = 0; x < 120; ++x)
      for (int c = 0; c < 3; ++c)
        mirrored.rgb[static_cast<std::size_t>(3 * (y * 120 + x) + c)] =
            right.rgb[static_cast<std::size_t>(3 * (y * 120 + 119 - x) + c)];
  for (std::size_t i = 0; i < right.rgb.size(); i += 3) std::swap(recoloured.rgb[i], recoloured.rgb[i + 2]);
  for (std::size_t i = 0; i < right.rgb.size(); i += 3) without.rgb[i] = 14;
  for (const Picture& wrong : {dark, mirrored, recoloured, without}) EXPECT_FALSE(compare(right, wrong).showsTheSame());
}

TEST(Golden, FilesKeepEveryPixel) {
  TempFolder folder;
  const Picture picture = threads(1);
  tools::writePng(picture, folder / "a.png");
  const Picture again = readPng(folder / "a.png");
  EXPECT_EQ(again.width, picture.width);
  EXPECT_EQ(again.rgb, picture.rgb);
  EXPECT_THROW(readPng(folder / "none.png"), std::runtime_error);
}

}  // namespace
}  // namespace filiform::test
