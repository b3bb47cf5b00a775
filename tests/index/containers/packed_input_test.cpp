// Inputs in gzip and tar.
#include "index/containers/internal/gunzip.h"
#include "index/errors.h"
#include "index/input/input.h"
#include "tests/support/gzip_bytes.h"
#include "tests/support/temp_folder.h"
#include "tests/support/variable.h"

#include <cstdint>
#include <cstdlib>
#include <filesystem>
#include <sstream>
#include <string>

#include <gtest/gtest.h>

namespace filiform {
namespace {

using internal::Gunzip;
using test::buildTar;
using test::gzipped;
using test::TarMember;

const std::string kFork = "1 1 0 0 0 5 -1\n2 3 0 6 0 1 1\n3 3 0 9 0 1 2\n";

std::string gunzipped(const std::string& bytes, std::size_t step, std::optional<InputCode>& wrong) {
  Gunzip gzip;
  std::string text;
  wrong.reset();
  for (std::size_t at = 0; at < bytes.size() && !wrong; at += step)
    wrong = gzip.feed(std::string_view(bytes).substr(at, step), [&](std::string_view block) { text += block; });
  if (!wrong) wrong = gzip.finish();
  return text;
}

TEST(Gunzip, GivesTheContentForAnyDivisionIntoBlocks) {
  std::string content;
  for (std::uint64_t i = 0; i < 50000; ++i) content += std::to_string(i * i) + " ";
  const std::string bytes =
      gzipped(content.substr(0, 1000)) + gzipped("") + gzipped(content.substr(1000)) + std::string(100, '\0');
  std::optional<InputCode> wrong;
  for (const std::size_t step : {std::size_t{1}, std::size_t{7}, std::size_t{4096}, bytes.size()}) {
    EXPECT_EQ(gunzipped(bytes, step, wrong), content);
    EXPECT_FALSE(wrong);
  }
}

TEST(Gunzip, DamageIsTold) {
  const std::string bytes = gzipped(kFork);
  std::optional<InputCode> wrong;
  for (std::size_t n = 0; n < bytes.size(); ++n) {
    gunzipped(bytes.substr(0, n), bytes.size(), wrong);
    EXPECT_EQ(wrong, InputCode::E_ZIP_TRUNCATED) << n;
  }
  for (std::size_t at = bytes.size() - 8; at < bytes.size(); ++at) {  // checksum and size
    std::string damaged = bytes;
    damaged[at] = static_cast<char>(damaged[at] ^ 1);
    gunzipped(damaged, damaged.size(), wrong);
    EXPECT_EQ(wrong, InputCode::E_ZIP_CRC) << at;
  }
  gunzipped(kFork, 100, wrong);
  EXPECT_EQ(wrong, InputCode::E_ZIP_FORMAT);
  gunzipped(bytes + std::string("\0x", 2), 1000, wrong);
  EXPECT_EQ(wrong, InputCode::E_ZIP_FORMAT);
}

std::string checkRowsOf(const std::string& path, std::vector<std::string>* sources = nullptr) {
  InputOptions options;
  options.threads = 3;
  Input input({path}, options);
  for (int pass = 0; pass < 2; ++pass) {
    if (sources != nullptr) sources->clear();
    for (Cell cell; input.next(cell);)
      if (sources != nullptr) sources->push_back(cell.source);
    input.rewind();
  }
  std::ostringstream table;
  writeCheckTable(table, input.reports());
  const std::string text = table.str();
  return text.substr(text.find('\n') + 1);
}

TEST(PackedCells, ReadAsTheFilesInside) {
  const test::TempFolder folder;
  test::writeBytes(folder.file("cell.swc.gz"), gzipped(kFork));
  test::writeBytes(folder.file("arbor.ASC.GZ"), gzipped("((Axon) (0 0 0 1) (1 0 0 1))"));
  EXPECT_EQ(checkRowsOf(folder.file("cell.swc.gz")), "cell.swc.gz\taccept\t3\t2\t-\t-\n");
  EXPECT_EQ(checkRowsOf(folder.path()), "arbor.ASC.GZ\taccept\t2\t1\t-\t-\ncell.swc.gz\taccept\t3\t2\t-\t-\n");
  EXPECT_EQ(cellNames({"x/cell.swc.gz", "x/n.CNG.swc.gz"}), (std::vector<std::string>{"cell", "n"}));
}

TEST(PackedCells, DamageRefusesTheFile) {
  const test::TempFolder folder;
  const std::string bytes = gzipped(kFork);
  test::writeBytes(folder.file("cut.swc.gz"), bytes.substr(0, bytes.size() - 9));
  EXPECT_EQ(checkRowsOf(folder.file("cut.swc.gz")), "cut.swc.gz\trefuse\t0\t0\t-\tE_ZIP_TRUNCATED:1\n");
  test::writeBytes(folder.file("plain.swc.gz"), kFork);
  EXPECT_EQ(checkRowsOf(folder.file("plain.swc.gz")), "plain.swc.gz\trefuse\t0\t0\t-\tE_ZIP_FORMAT:1\n");
}

TEST(PackedCells, MoreContentThanStatedIsReadAlone) {
  const test::TempFolder folder;
  std::string many;
  for (int i = 1; i <= 3000; ++i)
    many += std::to_string(i) + " 3 0 0 " + std::to_string(i) + " 1 " + std::to_string(i > 1 ? i - 1 : -1) + "\n";
  // The size of the last member is larger than the file, but smaller than the content.
  test::writeBytes(folder.file("a.swc.gz"), gzipped(many) + gzipped(std::string(60000, ' ')));
  test::writeBytes(folder.file("b.swc.gz"), gzipped(kFork));
  EXPECT_EQ(checkRowsOf(folder.path()), "a.swc.gz\taccept\t3000\t2999\t-\t-\nb.swc.gz\taccept\t3\t2\t-\t-\n");
}

TEST(PackedCells, ABombIsBoundedByTheMemory) {
  const test::TempFolder folder;
  test::writeBytes(folder.file("zeros.swc.gz"), gzipped(std::string(50 << 20, '0')));
  EXPECT_EQ(checkRowsOf(folder.file("zeros.swc.gz")), "zeros.swc.gz\trefuse\t0\t0\t1\tE_NO_SAMPLES:1,W_LONG_LINE:1\n");
  std::string lines;
  for (int i = 1; i <= 400000; ++i) lines += std::to_string(i) + " 3 0 0 0 1 -1\n";
  test::writeBytes(folder.file("lines.swc.gz"), gzipped(lines));
  InputOptions options;
  options.memory = 8 << 20;
  Input input({folder.file("lines.swc.gz")}, options);
  Cell cell;
  EXPECT_THROW(input.next(cell), InputError);
}

std::vector<TarMember> someMembers() {
  return {{"Lab/CNG version/b.CNG.swc", kFork},
          {"Lab/", "", '5'},
          {"Lab/notes.txt", "no cell"},
          {"Lab/a.swc", kFork + "4 3 0 12 0 1 3\n"},
          {"link.swc", "", '2'},
          {"x.swc", kFork, '0', "Lab/na\xC3\xAFve.swc"},
          {"../evil.swc", kFork},
          {"inner.zip", "PK"}};
}

TEST(Tar, PlainAndPackedGiveTheSame) {
  const test::TempFolder folder;
  const std::string tar = buildTar(someMembers());
  test::writeBytes(folder.file("lab.tar"), tar);
  test::writeBytes(folder.file("lab.tar.gz"), gzipped(tar));
  std::vector<std::string> plain, packed;
  const std::string row =
      "\twarn\t10\t7\tlink.swc,../evil.swc,inner.zip\tW_ZIP_LINK:1,W_ZIP_NESTED:1,W_ZIP_UNSAFE_NAME:1\n";
  EXPECT_EQ(checkRowsOf(folder.file("lab.tar"), &plain), "lab.tar" + row);
  EXPECT_EQ(checkRowsOf(folder.file("lab.tar.gz"), &packed), "lab.tar.gz" + row);
  EXPECT_EQ(plain, (std::vector<std::string>{"lab.tar/Lab/CNG version/b.CNG.swc", "lab.tar/Lab/a.swc",
                                             "lab.tar/Lab/na\xC3\xAFve.swc"}));
  EXPECT_EQ(packed.size(), 3u);
}

TEST(Tar, ACutArchiveIsRefusedWhole) {
  const test::TempFolder folder;
  const std::string tar = buildTar({{"a.swc", kFork}, {"b.swc", kFork}});
  const std::string packed = gzipped(tar);
  for (const std::size_t bytes : {std::size_t{600}, std::size_t{1024}, std::size_t{1536 + 20}, std::size_t{2048}}) {
    test::writeBytes(folder.file("cut.tar"), tar.substr(0, bytes));
    EXPECT_EQ(checkRowsOf(folder.file("cut.tar")), "cut.tar\trefuse\t0\t0\t-\tE_ZIP_TRUNCATED:1\n") << bytes;
  }
  test::writeBytes(folder.file("cut.tgz"), packed.substr(0, packed.size() - 12));
  EXPECT_EQ(checkRowsOf(folder.file("cut.tgz")), "cut.tgz\trefuse\t0\t0\t-\tE_ZIP_TRUNCATED:1\n");
  std::string damaged = packed;
  damaged[damaged.size() - 6] = static_cast<char>(damaged[damaged.size() - 6] ^ 1);
  test::writeBytes(folder.file("bad.tgz"), damaged);
  EXPECT_EQ(checkRowsOf(folder.file("bad.tgz")), "bad.tgz\trefuse\t0\t0\t-\tE_ZIP_CRC:1\n");
}

TEST(Tar, ARenamedFileIsRefused) {
  const test::TempFolder folder;
  test::writeBytes(folder.file("a.tar"), kFork);
  test::writeBytes(folder.file("b.tar.gz"), buildTar({{"a.swc", kFork}}));
  test::writeBytes(folder.file("c.tar"), buildTar({{"readme.txt", "x"}}));
  EXPECT_NE(checkRowsOf(folder.file("a.tar")).find("refuse\t0\t0\t-\tE_ZIP_"), std::string::npos);
  EXPECT_EQ(checkRowsOf(folder.file("b.tar.gz")), "b.tar.gz\trefuse\t0\t0\t-\tE_ZIP_FORMAT:1\n");
  EXPECT_EQ(checkRowsOf(folder.file("c.tar")), "c.tar\trefuse\t0\t0\t-\tE_ZIP_NO_SWC:1\n");
}

TEST(Tar, APackedArchiveOfZerosLeavesASmallTemporaryFile) {
  const test::TempFolder folder, temporary;
  const test::Variable variable("TMPDIR", temporary.path());
  test::writeBytes(folder.file("bomb.tar.gz"), gzipped(buildTar({{"zeros.swc", std::string(20 << 20, '\0')}})));
  EXPECT_EQ(checkRowsOf(folder.file("bomb.tar.gz")), "bomb.tar.gz\trefuse\t0\t0\tzeros.swc\tE_NOT_TEXT:1\n");
  EXPECT_TRUE(std::filesystem::is_empty(temporary.path()));
}

}  // namespace
}  // namespace filiform
