#include "index/containers/internal/archive.h"

#include "index/errors.h"
#include "index/input/input.h"
#include "tests/support/temp_folder.h"
#include "tests/support/zip_builder.h"

#include <fstream>
#include <sstream>
#include <string>
#include <vector>

#include <gtest/gtest.h>

namespace filiform {
namespace {

using test::buildZip;
using test::ZipMember;

const std::string kSwc = "1 1 0 0 0 5 -1\n2 3 0 6 0 1 1\n";
const ZipMember kGood{"good.swc", kSwc, {}, {}, {}};

ZipMember swcMember(const std::string& name, const std::string& content = kSwc) {
  ZipMember m;
  m.name = name;
  m.content = content;
  return m;
}

// The row of `check` for an archive, without the name: severity, samples, segments, dropped, codes.
std::string rowOfFile(const std::string& path) {
  Input input({path});
  for (Cell cell; input.next(cell);) EXPECT_GT(cell.samples(), 0u);
  std::ostringstream table;
  writeCheckTable(table, input.reports());
  const std::string text = table.str();
  std::string row = text.substr(text.find('\n') + 1);
  row = row.substr(row.find('\t') + 1);
  for (char& c : row) {
    if (c == '\t') c = ' ';
  }
  return row.substr(0, row.size() - 1);
}

std::string archiveRow(const std::string& bytes) {
  const test::TempFolder folder;
  test::writeBytes(folder.file("a.zip"), bytes);
  return rowOfFile(folder.file("a.zip"));
}

std::string archiveRow(const std::vector<ZipMember>& members) { return archiveRow(buildZip(members)); }

TEST(Archive, SumsOverItsEntries) {
  EXPECT_EQ(archiveRow({kGood, swcMember("x/CNG version/two.CNG.SWC"), swcMember("readme.txt")}), "accept 4 2 - -");
}

// As WinZip writes names with umlauts: the name in cp437, and the same in UTF-8 behind it.
TEST(Archive, AUnicodePathIsTheName) {
  const test::TempFolder folder;
  ZipMember member = swcMember("z\x81rich.swc");
  member.extra = test::unicodePath(member.name, "zürich.swc");
  test::writeBytes(folder.file("a.zip"), buildZip({member, kGood}));
  Input input({folder.file("a.zip")});
  std::vector<std::string> sources;
  for (Cell cell; input.next(cell);) sources.push_back(cell.source);
  EXPECT_EQ(sources, (std::vector<std::string>{"a.zip/good.swc", "a.zip/zürich.swc"}));
  member.extra = test::unicodePath("another name", "zürich.swc");  // its checksum is of another name
  EXPECT_EQ(archiveRow({member, kGood}), "warn 4 2 - W_ZIP_NAME_ENCODING:1");
}

TEST(Archive, SwcUnderOtherEndingsIsRead) {
  EXPECT_EQ(archiveRow({swcMember("a.eswc"), swcMember("b.ano.eswc"), swcMember("c.swc.txt"), swcMember("d.txt")}),
            "accept 6 3 - -");
}

TEST(Archive, DeflatedEntriesAreRead) {
  const test::TempFolder folder;
  const auto swcOf = [](int samples) {
    std::string swc;
    for (int i = 1; i <= samples; ++i)
      swc += std::to_string(i) + " 3 0 0 " + std::to_string(i) + " 1 " + std::to_string(i > 1 ? i - 1 : -1) + "\n";
    return swc;
  };
  const std::string large = swcOf(60000);
  ASSERT_GT(large.size(), std::size_t{1} << 20);  // too large to be unpacked in one piece
  test::writeDeflatedZip(folder.file("a.zip"),
                         {swcMember("one.swc", swcOf(20000)), swcMember("two.swc", large), swcMember("three.swc")});
  EXPECT_EQ(rowOfFile(folder.file("a.zip")), "accept 80002 79999 - -");
}

TEST(Archive, EveryDamagedByteOfADeflatedEntryRefusesIt) {
  const test::TempFolder folder;
  std::string content;
  for (int i = 1; i <= 40; ++i)
    content += std::to_string(i) + " 3 0 0 0 1 " + std::to_string(i > 1 ? i - 1 : -1) + "\n";
  test::writeDeflatedZip(folder.file("a.zip"), {swcMember("a.swc", content)});
  const std::string zip = test::readBytes(folder.file("a.zip"));
  const std::size_t begin = 30 + std::string("a.swc").size();
  for (std::size_t at = begin; at < begin + 60; ++at) {
    std::string damaged = zip;
    damaged[at] = static_cast<char>(damaged[at] ^ 4);
    const std::string row = archiveRow(damaged);
    EXPECT_TRUE(row.starts_with("refuse 0 0 a.swc E_ZIP_") || row == "accept 40 39 - -") << at << ": " << row;
  }
}

TEST(Archive, DroppedLinesNameTheirEntry) {
  EXPECT_EQ(archiveRow({kGood, swcMember("bad.swc", kSwc + "oops\n3 3 nan 0 0 1 1\n")}),
            "warn 4 2 bad.swc:3,bad.swc:4 W_NONFINITE:1,W_SHORT_LINE:1");
}

TEST(Archive, ARefusedEntryIsDroppedAsAWhole) {
  EXPECT_EQ(archiveRow({kGood, swcMember("page.swc", "<html>\n")}), "warn 2 1 page.swc E_NO_SAMPLES:1,W_SHORT_LINE:1");
  EXPECT_EQ(archiveRow({swcMember("page.swc", "")}), "refuse 0 0 page.swc E_NO_SAMPLES:1,E_ZIP_NO_SWC:1");
}

TEST(Archive, NamesThatClimbOutAreSkipped) {
  EXPECT_EQ(archiveRow({kGood, swcMember("a/../../evil.swc"), swcMember("..\\evil.swc"), swcMember("..")}),
            "warn 2 1 a/../../evil.swc,..\\evil.swc W_ZIP_UNSAFE_NAME:2");
}

TEST(Archive, OddNamesAreReadUnderAPlainOne) {
  const test::TempFolder folder;
  test::writeBytes(folder.file("a.zip"),
                   buildZip({swcMember("/etc/abs.swc"), swcMember("C:\\x\\drive.swc"), swcMember("\\\\host\\unc.swc"),
                             swcMember("tab\there\x1B[1m.swc"), swcMember("..dots../fine.swc")}));
  Input input({folder.file("a.zip")});
  std::vector<std::string> sources;
  for (Cell cell; input.next(cell);) sources.push_back(cell.source);
  EXPECT_EQ(sources, (std::vector<std::string>{"a.zip/..dots../fine.swc", "a.zip/etc/abs.swc", "a.zip/host/unc.swc",
                                               "a.zip/tab\\there\\x1b[1m.swc", "a.zip/x/drive.swc"}));
  EXPECT_EQ(input.reports()[0].report.codes[InputCode::W_ZIP_NAME], 4u);
}

TEST(Archive, NamesThatAreNotUtf8AreKept) {
  EXPECT_EQ(archiveRow({swcMember("caf\xE9.swc"), swcMember("caf\xC3\xA9.swc")}), "warn 4 2 - W_ZIP_NAME_ENCODING:1");
  EXPECT_EQ(archiveRow({kGood, swcMember("caf\xE9.swc", "")}),
            "warn 2 1 caf\\xe9.swc E_NO_SAMPLES:1,W_ZIP_NAME_ENCODING:1");
}

TEST(Archive, EqualNamesAreKeptApart) { EXPECT_EQ(archiveRow({kGood, kGood, kGood}), "warn 6 3 - W_ZIP_DUP_NAME:2"); }

TEST(Archive, LinksAndInnerArchivesAreNotOpened) {
  ZipMember link = swcMember("link.swc", "/etc/passwd");
  link.attributes = test::kSymbolicLinkAttributes;
  EXPECT_EQ(archiveRow({kGood, link, swcMember("in/inner.ZIP", buildZip({kGood}))}),
            "warn 2 1 link.swc,in/inner.ZIP W_ZIP_LINK:1,W_ZIP_NESTED:1");
}

TEST(Archive, ClutterIsIgnored) {
  EXPECT_EQ(archiveRow({kGood, swcMember("__MACOSX/._good.swc", "x"), swcMember("a/._b.swc", "x"),
                        swcMember("folder.swc/", ""), swcMember("._c.zip", "x")}),
            "accept 2 1 - -");
}

TEST(Archive, AnEntryWithABadChecksumIsRefused) {
  ZipMember rotten = swcMember("rotten.swc");
  rotten.crc32 = 0xDEADBEEF;
  EXPECT_EQ(archiveRow({kGood, rotten}), "warn 2 1 rotten.swc E_ZIP_CRC:1");
  EXPECT_EQ(archiveRow({rotten}), "refuse 0 0 rotten.swc E_ZIP_CRC:1");
}

TEST(Archive, AnEntryOfAnotherSizeIsRefused) {
  for (const std::uint32_t bytes : {10u, 1000u}) {
    ZipMember liar = swcMember("liar.swc");
    liar.bytes = bytes;
    EXPECT_EQ(archiveRow({kGood, liar}), "warn 2 1 liar.swc E_ZIP_SIZE:1") << bytes;
  }
}

TEST(Archive, NothingBeyondTheDeclaredSizeIsHandedOver) {
  const test::TempFolder folder;
  ZipMember liar = swcMember("liar.swc", std::string(500000, '1'));
  liar.bytes = 70000;
  test::writeBytes(folder.file("a.zip"), buildZip({liar}));
  Archive archive(folder.file("a.zip"));
  Archive::Reader reader(archive);
  std::size_t got = 0;
  EXPECT_EQ(reader.read(archive.entries()[0], [&](std::string_view bytes) { got += bytes.size(); }),
            InputCode::E_ZIP_SIZE);
  EXPECT_LE(got, 70000u);
}

TEST(Archive, EncryptedAndUnknownMethodsAreRefused) {
  ZipMember locked = swcMember("locked.swc"), odd = swcMember("odd.swc");
  locked.flags = 1;
  odd.method = 77;
  EXPECT_EQ(archiveRow({kGood, locked, odd}), "warn 2 1 locked.swc,odd.swc E_ZIP_METHOD:2");
}

TEST(Archive, OverlappingEntriesRefuseTheArchive) {
  ZipMember second = swcMember("second.swc");
  second.header_at = 0;
  EXPECT_EQ(archiveRow({kGood, second}), "refuse 0 0 - E_ZIP_OVERLAP:1");
  second.header_at = 40;
  EXPECT_EQ(archiveRow({kGood, second}), "refuse 0 0 - E_ZIP_OVERLAP:1");
}

// Every truncation is recognised, except after one byte, which could begin any file.
TEST(Archive, EveryTruncationIsRefused) {
  const test::TempFolder folder;
  const std::string path = folder.file("a.zip");
  const std::string whole = buildZip({kGood, swcMember("two.swc")}, "a comment");
  for (std::size_t size = 0; size < whole.size(); ++size) {
    test::writeBytes(path, whole.substr(0, size));
    EXPECT_EQ(Archive(path).refusal(), size < 2 ? InputCode::E_ZIP_FORMAT : InputCode::E_ZIP_TRUNCATED)
        << size << " bytes";
  }
  test::writeBytes(path, whole);
  EXPECT_FALSE(Archive(path).refusal());
}

TEST(Archive, AMissingStartIsATruncation) {
  EXPECT_EQ(archiveRow(buildZip({kGood, swcMember("two.swc")}).substr(50)), "refuse 0 0 - E_ZIP_TRUNCATED:1");
}

TEST(Archive, OtherFilesAreNoArchive) {
  EXPECT_EQ(archiveRow(kSwc), "refuse 0 0 - E_ZIP_FORMAT:1");
  EXPECT_EQ(archiveRow(std::string()), "refuse 0 0 - E_ZIP_FORMAT:1");
  EXPECT_EQ(archiveRow(std::string("PK") + kSwc), "refuse 0 0 - E_ZIP_FORMAT:1");
}

TEST(Archive, WithoutSwcItIsRefused) {
  EXPECT_EQ(archiveRow(std::vector<ZipMember>{}), "refuse 0 0 - E_ZIP_NO_SWC:1");
  EXPECT_EQ(archiveRow({swcMember("readme.txt")}), "refuse 0 0 - E_ZIP_NO_SWC:1");
  EXPECT_EQ(archiveRow({swcMember("inner.zip")}), "refuse 0 0 inner.zip E_ZIP_NO_SWC:1,W_ZIP_NESTED:1");
}

TEST(Archive, SignaturesInTheCommentDoNotMislead) {
  const std::string empty_archive = std::string("PK\5\6") + std::string(18, '\0');
  EXPECT_EQ(archiveRow(buildZip({kGood}, "see PK\5\6 in here, it is legal")), "accept 2 1 - -");
  EXPECT_EQ(archiveRow(buildZip({kGood}, "PK\1\2PK\5\6" + std::string(30, 'x'))), "accept 2 1 - -");
  EXPECT_EQ(archiveRow(buildZip({kGood}, empty_archive)), "accept 2 1 - -");
  EXPECT_EQ(archiveRow(buildZip({kGood, swcMember("two.swc")}, buildZip({swcMember("fake.swc")}))), "accept 4 2 - -");
}

TEST(Archive, BytesBeforeTheArchiveAreAllowed) {
  EXPECT_EQ(archiveRow(buildZip({kGood}, "", "#!/bin/sh\nexit\n")), "accept 2 1 - -");
}

// Sets every byte of a small archive to three other values. The archive may be refused or read; content read must be
// intact.
TEST(Archive, DamageNeverPassesForData) {
  const test::TempFolder folder;
  const std::string path = folder.file("a.zip");
  const std::string whole = buildZip({kGood, swcMember("two.swc")}, "c");
  for (std::size_t at = 0; at < whole.size(); ++at) {
    for (const int flip : {0x01, 0x80, 0xFF}) {
      std::string damaged = whole;
      damaged[at] = static_cast<char>(damaged[at] ^ flip);
      test::writeBytes(path, damaged);
      Archive archive(path);
      Archive::Reader reader(archive);
      for (const ArchiveEntry& entry : archive.entries()) {
        if (entry.skipped) continue;
        std::string content;
        if (!reader.read(entry, [&](std::string_view bytes) { content += bytes; })) {
          EXPECT_EQ(content, kSwc) << "byte " << at << " flipped by " << flip;
        }
      }
    }
  }
}

TEST(Archive, MoreEntriesThanSixteenBitsCountAreAllRead) {
  const test::TempFolder folder;
  std::vector<ZipMember> members;
  for (int i = 0; i < 65600; ++i) members.push_back(swcMember(std::to_string(i) + ".swc", "1 1 0 0 0 5 -1\n"));
  test::writeDeflatedZip(folder.file("a.zip"), members);
  Archive archive(folder.file("a.zip"));
  Archive::Reader reader(archive);
  EXPECT_FALSE(archive.refusal());
  ASSERT_EQ(archive.entries().size(), members.size());
  std::string content;
  EXPECT_FALSE(reader.read(archive.entries().back(), [&](std::string_view bytes) { content += bytes; }));
  EXPECT_EQ(content, members.back().content);
}

std::string zipNumber(std::uint64_t value, int bytes) {
  std::string out;
  for (int i = 0; i < bytes; ++i) out += static_cast<char>(value >> (8 * i));
  return out;
}

// An archive of one entry with all possible fields moved to zip64.
std::string inZip64(std::uint64_t size_lie = 0) {
  const std::string plain = buildZip({kGood});
  const std::size_t end_at = plain.size() - 22;
  const std::size_t directory_at = plain.rfind("PK\1\2");
  std::string entry = plain.substr(directory_at, end_at - directory_at);
  const std::string all = zipNumber(UINT64_MAX, 4);
  const std::string extra = zipNumber(1, 2) + zipNumber(24, 2) + zipNumber(kSwc.size() + size_lie, 8) +
                            zipNumber(kSwc.size() + size_lie, 8) + zipNumber(0, 8);
  entry.replace(20, 4, all).replace(24, 4, all).replace(42, 4, all).replace(30, 2, zipNumber(extra.size(), 2));
  entry += extra;
  std::string zip = plain.substr(0, directory_at) + entry;
  const std::size_t end64_at = zip.size();
  zip += "PK\6\6" + zipNumber(44, 8) + zipNumber(45, 2) + zipNumber(45, 2) + zipNumber(0, 8) + zipNumber(1, 8) +
         zipNumber(1, 8) + zipNumber(entry.size(), 8) + zipNumber(directory_at, 8);
  zip += "PK\6\7" + zipNumber(0, 4) + zipNumber(end64_at, 8) + zipNumber(1, 4);
  zip += "PK\5\6" + zipNumber(0, 4) + zipNumber(0xFFFF, 2) + zipNumber(0xFFFF, 2) + all + all + zipNumber(0, 2);
  return zip;
}

TEST(Archive, SizesAndPlacesMayStandInZip64Fields) {
  EXPECT_EQ(archiveRow(inZip64()), "accept 2 1 - -");
  // A false size of 4 GiB and more.
  const std::string found = archiveRow(inZip64(std::uint64_t{1} << 33));
  EXPECT_TRUE(found.starts_with("refuse 0 0 ")) << found;
}

// Bytes that this thread has read from files.
std::uint64_t bytesRead() {
  std::ifstream counts("/proc/thread-self/io");
  std::string name;
  std::uint64_t bytes = 0;
  counts >> name >> bytes;
  return name == "rchar:" ? bytes : 0;
}

// Each end record states a directory that fails only after its last entry: reading all of them takes the square of the
// file's size.
TEST(Archive, ManyEndRecordsThatStateTheSameLongDirectoryAreNotAllRead) {
  if (bytesRead() == 0) GTEST_SKIP() << "this system does not count what a thread reads";
  const std::string plain = buildZip({kGood});
  const std::size_t directory_at = plain.rfind("PK\1\2");
  std::string entry = plain.substr(directory_at, plain.size() - 22 - directory_at);
  entry.replace(32, 2, zipNumber(60000, 2)) += std::string(60000, 'c');  // its comment
  constexpr std::uint64_t kEntries = 20, kRecords = 2900;
  std::string zip;
  for (std::uint64_t i = 0; i < kEntries; ++i) zip += entry;
  for (std::uint64_t i = 0; i < kRecords; ++i)
    zip += "PK\5\6" + zipNumber(0, 4) + zipNumber(kEntries + 1, 2) + zipNumber(kEntries + 1, 2) +
           zipNumber(zip.size(), 4) + zipNumber(0, 4) + zipNumber(22 * (kRecords - 1 - i), 2);
  const test::TempFolder folder;
  test::writeBytes(folder.file("a.zip"), zip);
  const std::uint64_t before = bytesRead();
  EXPECT_TRUE(Archive(folder.file("a.zip")).refusal());
  EXPECT_LT(bytesRead() - before, 6 * zip.size() + (std::uint64_t{32} << 20));
  EXPECT_GT(kRecords * zip.size(), std::uint64_t{1} << 30);  // without a limit
}

// Small entries that share one long content: none of them is read.
TEST(Archive, OverlappingEntriesAreRefusedBeforeTheyAreRead) {
  if (bytesRead() == 0) GTEST_SKIP() << "this system does not count what a thread reads";
  const std::string content(1 << 20, '1');
  std::vector<ZipMember> members{swcMember("0.swc", content)};
  for (int i = 1; i < 1000; ++i) {
    ZipMember member = swcMember(std::to_string(i) + ".swc", "");
    member.header_at = 0;
    member.bytes = static_cast<std::uint32_t>(content.size());
    members.push_back(member);
  }
  const test::TempFolder folder;
  test::writeBytes(folder.file("a.zip"), buildZip(members));
  const std::uint64_t before = bytesRead();
  EXPECT_EQ(rowOfFile(folder.file("a.zip")), "refuse 0 0 - E_ZIP_OVERLAP:1");
  EXPECT_LT(bytesRead() - before, content.size());
}

TEST(Archive, AMissingFileIsNamed) { EXPECT_THROW(Archive("no/such.zip"), IoError); }

}  // namespace
}  // namespace filiform
