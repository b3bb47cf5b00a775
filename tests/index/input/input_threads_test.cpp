// Input with several reading threads: the same cells and reports as with one.
#include "index/errors.h"
#include "index/input/input.h"
#include "tests/support/temp_folder.h"
#include "tests/support/zip_builder.h"

#include <filesystem>
#include <iterator>
#include <sstream>

#include <gtest/gtest.h>

namespace filiform {
namespace {

namespace fs = std::filesystem;

const std::string kSegment = "1 1 0 0 0 5 -1\n2 3 0 6 0 1 1\n";

// All that a pass yields: sources, digests and samples of the cells, and the table of reports with every record.
std::string passOf(Input& input) {
  std::ostringstream out;
  for (Cell cell; input.next(cell);) {
    out << cell.source << ' ' << cell.digest;
    for (std::size_t i = 0; i < cell.samples(); ++i)
      out << ' ' << cell.sample_ids[i] << ',' << cell.positions_um[i].transpose() << ',' << cell.parents[i];
    out << '\n';
  }
  writeCheckTable(out, input.reports());
  for (const SourceReport& row : input.reports()) {
    out << row.digest << '\n';
    for (const EntryReport& entry : row.entries)
      for (const InputRecord& record : entry.report.records) out << record.line << ' ' << record.token << '\n';
  }
  return out.str() + summary(input.reports()) + input.unitDoubt();
}

// Files and archives, some of them damaged, some of equal name.
void putMany(const test::TempFolder& folder) {
  for (int i = 0; i < 50; ++i) {
    std::string text = "# " + std::to_string(i) + "\n";
    for (int n = 1; n <= 20 + i * i / 4; ++n)
      text +=
          std::to_string(n) + " 3 " + std::to_string(n + i) + " 0 0 1 " + std::to_string(n == 1 ? -1 : n - 1) + "\n";
    if (i % 7 == 0) text += "oops\n";
    if (i % 11 == 0) text.clear();
    test::writeBelow(folder, "f" + std::to_string(i) + ".swc", text);
    if (i % 5 == 0)
      test::writeBelow(
          folder, "z" + std::to_string(i) + ".zip",
          test::buildZip({test::zipMember("x.swc", text), test::zipMember("x.swc", text + "99999 1 0 0 0 1 -1\n"),
                          test::zipMember("/y.swc", kSegment), test::zipMember("w.swc", text)}));
  }
  std::string broken = test::buildZip({test::zipMember("c.swc", kSegment), test::zipMember("d.swc", kSegment)});
  broken[40] = static_cast<char>(broken[40] ^ 0x55);
  test::writeBelow(folder, "broken.zip", broken);
  test::writeBelow(folder, "loop.swc", "1 1 0 0 0 1 2\n2 1 1 0 0 1 1\n");
}

TEST(InputThreads, ChangeNeitherCellsNorReports) {
  const test::TempFolder folder;
  putMany(folder);
  Input alone({folder.path()});
  const std::string expected = passOf(alone);
  for (const unsigned threads : {2u, 5u}) {
    for (const std::uint64_t memory : {std::uint64_t{128} << 20, std::uint64_t{800} << 20}) {
      InputOptions options;
      options.threads = threads;
      options.memory = memory;
      Input input({folder.path()}, options);
      EXPECT_EQ(passOf(input), expected) << threads << " threads";
      input.rewind();
      EXPECT_EQ(passOf(input), expected) << threads << " threads, second pass";
    }
  }
}

// A thread holds the directory of an archive once, however many archives it could keep open.
TEST(InputThreads, ReadAnArchiveOfManyMembersInModestMemory) {
  const test::TempFolder folder;
  std::vector<test::ZipMember> members;
  for (int i = 0; i < 20000; ++i) members.push_back(test::zipMember(std::to_string(i) + ".swc", kSegment));
  test::writeBytes(folder.file("many.zip"), test::buildZip(members));
  InputOptions options;
  options.threads = 2;
  options.memory = std::uint64_t{180} << 20;  // a sixth of it for two readers: 16 MiB and 20 000 * 512 bytes each
  const auto threads = [] { return std::distance(fs::directory_iterator("/proc/self/task"), {}); };
  const auto before = threads();
  Input input({folder.file("many.zip")}, options);
  Cell cell;
  for (int i = 0; i < 50; ++i) ASSERT_TRUE(input.next(cell));
  EXPECT_EQ(threads(), before + 1);
}

TEST(InputThreads, ForgetAnUnfinishedPass) {
  const test::TempFolder folder;
  putMany(folder);
  Input alone({folder.path()});
  const std::string expected = passOf(alone);
  InputOptions options;
  options.threads = 4;
  Input input({folder.path()}, options);
  Cell cell;
  for (int i = 0; i < 10; ++i) ASSERT_TRUE(input.next(cell));
  input.rewind();
  EXPECT_EQ(passOf(input), expected);
}

TEST(InputThreads, ReportAFileThatVanishedInItsPlace) {
  const test::TempFolder folder;
  for (const char* name : {"a.swc", "b.swc", "c.swc", "d.swc"}) test::writeBelow(folder, name, kSegment);
  InputOptions options;
  options.threads = 3;
  Input input({folder.path()}, options);
  fs::remove(folder.file("c.swc"));
  Cell cell;
  for (const char* name : {"a.swc", "b.swc", "d.swc"}) {
    ASSERT_TRUE(input.next(cell));
    EXPECT_EQ(cell.source, name);
  }
  EXPECT_FALSE(input.next(cell));
  EXPECT_EQ(totals(input.reports()).refused, 1u);
  fs::remove(folder.file("b.swc"));
  input.rewind();
  ASSERT_TRUE(input.next(cell));
  EXPECT_EQ(cell.source, "a.swc");
  EXPECT_THROW(input.next(cell), IoError);
}

TEST(InputThreads, EndWithWhatTheProgressThrows) {
  const test::TempFolder folder;
  putMany(folder);
  InputOptions options;
  options.threads = 3;
  int calls = 0;
  options.progress = [&](std::uint64_t, std::uint64_t) {
    if (++calls == 5) throw IoError("screen", "gone");
  };
  Input input({folder.path()}, options);
  EXPECT_THROW(passOf(input), IoError);
  EXPECT_EQ(calls, 5);
}

}  // namespace
}  // namespace filiform
