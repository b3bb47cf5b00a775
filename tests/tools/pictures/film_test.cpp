#include "tools/pictures/film.h"

#include "index/errors.h"
#include "tests/support/golden.h"
#include "tests/support/temp_folder.h"

#include <algorithm>
#include <cstdlib>
#include <filesystem>
#include <iterator>

#include <gtest/gtest.h>

namespace filiform::tools {
namespace {

namespace fs = std::filesystem;

Picture greyPicture(std::uint8_t grey) { return {6, 4, std::vector<std::uint8_t>(72, grey)}; }

// Restores PATH at the end.
class OnPath {
 public:
  // Puts the folder in PATH: alone, or before the present folders.
  OnPath(const std::string& folder, bool alone) : before_(std::getenv("PATH")) {
    std::string path = folder;
    if (!alone) {
      path += ':';
      path += before_;
    }
    ::setenv("PATH", path.c_str(), 1);
  }
  ~OnPath() { ::setenv("PATH", before_.c_str(), 1); }
  OnPath(const OnPath&) = delete;
  OnPath& operator=(const OnPath&) = delete;

 private:
  std::string before_;
};

// Writes a substitute for ffmpeg: it copies its input into the file named last, or fails.
void putEncoder(const test::TempFolder& folder, const std::string& script) {
  fs::create_directory(folder / "bin");
  test::writeBytes(folder / "bin/ffmpeg", "#!/bin/sh\n" + script);
  fs::permissions(folder / "bin/ffmpeg", fs::perms::owner_all);
}

TEST(Film, NumbersASequence) {
  test::TempFolder folder;
  Film film(folder / "a%03d.png", 6, 4, 30);
  film.add(greyPicture(10));
  film.add(greyPicture(20));
  film.finish();
  EXPECT_EQ(film.pictures(), 2u);
  EXPECT_TRUE(film.note().empty());
  EXPECT_EQ(test::readPng(folder / "a001.png").rgb[0], 10);
  EXPECT_EQ(test::readPng(folder / "a002.png").rgb[0], 20);
}

TEST(Film, HandsEveryPictureToTheEncoderAndPublishesItsFile) {
  test::TempFolder folder;
  putEncoder(folder, "for last; do :; done\nexec cat > \"$last\"\n");
  const OnPath path(folder / "bin", false);
  {
    Film film(folder / "a.mp4", 6, 4, 30);
    for (const std::uint8_t grey : {1, 2, 3}) film.add(greyPicture(grey));
    EXPECT_FALSE(fs::exists(folder / "a.mp4"));
    film.finish();
  }
  const std::string bytes = test::readBytes(folder / "a.mp4");
  ASSERT_EQ(bytes.size(), 3u * 6 * 4 * 3);
  EXPECT_EQ(bytes.front(), 1);
  EXPECT_EQ(bytes.back(), 3);
  { Film dropped(folder / "b.mp4", 6, 4, 30); }
  EXPECT_FALSE(fs::exists(folder / "b.mp4"));
  EXPECT_EQ(std::distance(fs::directory_iterator(folder.path()), fs::directory_iterator()), 2) << "bin and a.mp4";
}

TEST(Film, NamesTheFilesThatASequenceWouldReplace) {
  test::TempFolder folder;
  for (const char* name : {"a-1.png", "a-00020.png", "a-x.png", "b-1.png", "a-1.png.swc"})
    test::writeBytes(folder / name, "x");
  std::vector<std::string> files = filesOfSequence(folder / "a-%05d.png");
  std::sort(files.begin(), files.end());
  EXPECT_EQ(files, (std::vector<std::string>{folder / "a-00020.png", folder / "a-1.png"}));
  EXPECT_TRUE(filesOfSequence(folder / "a.mp4").empty());
}

TEST(Film, SaysWhyTheEncoderGaveUp) {
  test::TempFolder folder;
  putEncoder(folder, "echo no such codec >&2\nexit 1\n");
  const OnPath path(folder / "bin", false);
  Film film(folder / "a.mp4", 6, 4, 30);
  try {
    for (int i = 0; i < 100; ++i) film.add(greyPicture(1));
    film.finish();
    FAIL();
  } catch (const IoError& error) {
    EXPECT_NE(std::string(error.what()).find("no such codec"), std::string::npos) << error.what();
  }
  EXPECT_FALSE(fs::exists(folder / "a.mp4"));
}

TEST(Film, WithoutAnEncoderThePicturesAreASequenceBesideIt) {
  test::TempFolder folder;
  const OnPath path(folder / "bin", true);
  Film film(folder / "a.mp4", 6, 4, 30);
  EXPECT_NE(film.note().find("ffmpeg"), std::string::npos);
  film.add(greyPicture(7));
  film.finish();
  EXPECT_TRUE(fs::exists(folder / "a-00001.png"));
}

TEST(Film, RefusesOtherNames) {
  EXPECT_THROW(Film("a.png", 6, 4, 30), UsageError);
  EXPECT_THROW(Film("a%d%d.png", 6, 4, 30), UsageError);
  EXPECT_THROW(Film("a%d.png", 6, 4, 0), UsageError);
  EXPECT_TRUE(isFilmName("a%05d.png"));
  EXPECT_FALSE(isFilmName("a.png"));
  EXPECT_FALSE(isFilmName("a%s.png"));
}

}  // namespace
}  // namespace filiform::tools
