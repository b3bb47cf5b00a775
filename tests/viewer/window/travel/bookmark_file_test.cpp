#include "viewer/window/travel/internal/bookmark_file.h"

#include "index/errors.h"

#include <gtest/gtest.h>

namespace filiform::internal {
namespace {

TEST(BookmarkFiles, ComeBackAsTheyWereWritten) {
  const std::vector<BookmarkRow> rows{{"a", "cell_1", 7, {1, -2.5, 3e5}},
                                      {"bouton, the \"second\"\nof two", "x;y", std::nullopt, {0, 0, 0.125}}};
  const std::string text = bookmarksCsv(rows);
  const ReadBookmarks read = readBookmarks(text);
  EXPECT_EQ(read.left_out, 0u);
  ASSERT_EQ(read.rows.size(), 2u);
  for (std::size_t i = 0; i < 2; ++i) {
    EXPECT_EQ(read.rows[i].name, rows[i].name);
    EXPECT_EQ(read.rows[i].p_W, rows[i].p_W);
  }
  EXPECT_TRUE(text.starts_with("name,cell,sample,x_um,y_um,z_um\na,cell_1,7,1.0000,-2.5000,300000.0000\n")) << text;
}

TEST(BookmarkFiles, ATableOfASpreadsheetIsRead) {
  const ReadBookmarks read = readBookmarks(
      "\xEF\xBB\xBFz_um;name;note;y_um;x_um\r\n3;spine;x;2;1\r\n\r\n4;;x;2;1\r\n3;b;x;2\r\n3;c;x;2;nan\r\n3;d;;2;"
      "1e300\r\n");
  ASSERT_EQ(read.rows.size(), 1u);
  EXPECT_EQ(read.rows[0].name, "spine");
  EXPECT_EQ(read.rows[0].p_W, Vector3d(1, 2, 3));
  EXPECT_EQ(read.left_out, 4u) << "no name, no x, no number, too far";
}

TEST(BookmarkFiles, OtherTextIsRefusedAndMoreRowsAreCounted) {
  EXPECT_THROW(readBookmarks(""), UsageError);
  EXPECT_THROW(readBookmarks("name,x,y,z\na,1,2,3\n"), UsageError);
  std::string many = "name,x_um,y_um,z_um\n";
  for (int i = 0; i < 10'007; ++i) many += std::to_string(i) + ",1,2,3\n";
  const ReadBookmarks read = readBookmarks(many);
  EXPECT_EQ(read.rows.size(), ReadBookmarks::kMost);
  EXPECT_EQ(read.left_out, 7u);
}

}  // namespace
}  // namespace filiform::internal
