#include "tools/pictures/png.h"

#include "index/errors.h"
#include "tests/support/golden.h"
#include "tests/support/temp_folder.h"

#include <filesystem>
#include <signal.h>
#include <sys/resource.h>

#include <gtest/gtest.h>

namespace filiform::tools {
namespace {

Picture noise(int width, int height) {
  Picture picture{width, height, std::vector<std::uint8_t>(static_cast<std::size_t>(3 * width * height))};
  unsigned state = 1;
  for (auto& byte : picture.rgb) byte = static_cast<std::uint8_t>((state = state * 1664525U + 1013904223U) >> 24);
  return picture;
}

TEST(WritePng, ReadsBackPixelForPixel) {
  const test::TempFolder folder;
  const Picture picture = noise(37, 21);
  writePng(picture, folder.file("a.png"));
  const Picture back = test::readPng(folder.file("a.png"));
  EXPECT_EQ(back.width, 37);
  EXPECT_EQ(back.rgb, picture.rgb);
}

TEST(WritePng, LeavesNothingHalfWritten) {
  const test::TempFolder folder;
  const Picture picture = noise(400, 400);
  EXPECT_THROW(writePng(picture, folder.file("no/such/folder.png")), IoError);
  const auto old_handler = signal(SIGXFSZ, SIG_IGN);
  rlimit old_limit{};
  getrlimit(RLIMIT_FSIZE, &old_limit);
  const rlimit small{10000, old_limit.rlim_max};
  ASSERT_EQ(setrlimit(RLIMIT_FSIZE, &small), 0);
  EXPECT_THROW(writePng(picture, folder.file("a.png")), IoError);
  setrlimit(RLIMIT_FSIZE, &old_limit);
  signal(SIGXFSZ, old_handler);
  EXPECT_TRUE(std::filesystem::is_empty(folder.path()));
}

}  // namespace
}  // namespace filiform::tools
