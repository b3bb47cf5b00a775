// Files of a set over HTTP: names, ranges, tags, and a revision that is replaced.
#include "index/ingest/growth.h"
#include "index/ingest/ingest.h"
#include "tests/support/scenes/random_cells.h"
#include "tests/support/servers/served_sets.h"

#include <string>
#include <vector>

#include <gtest/gtest.h>

namespace filiform::tools {
namespace {

using test::contentOf;
using test::readBytes;

class FileAnswer : public ::testing::Test {
 protected:
  std::string revision() const { return sets_.shelf->find("column")->set().revision(); }
  std::string target(const std::string& file) const { return "/v1/sets/column/files/" + revision() + "/" + file; }
  test::ServedSets sets_;
};

TEST_F(FileAnswer, EveryFileOfTheRevisionIsServed) {
  const Answer current = sets_.get("/v1/sets/column/files/CURRENT");
  EXPECT_EQ(current.body, readBytes(sets_.folder / "column.fil/CURRENT"));
  EXPECT_EQ(current.header("Cache-Control"), "no-store");
  std::vector<std::string> names{"manifest.json"};
  for (const SetFile& file : sets_.shelf->find("column")->set().files()) names.push_back(file.name);
  ASSERT_GE(names.size(), 5u);
  for (const std::string& name : names) {
    const std::string bytes = readBytes(sets_.folder / ("column.fil/" + revision() + "/" + name));
    const Answer whole = sets_.get(target(name));
    ASSERT_EQ(whole.status, 200u) << name;
    EXPECT_EQ(contentOf(whole), bytes) << name;
    EXPECT_NE(whole.header("Cache-Control").find("immutable"), std::string::npos);
    EXPECT_EQ(whole.header("Accept-Ranges"), "bytes");
    // The layout of the folder itself.
    EXPECT_EQ(contentOf(sets_.get("/v1/sets/column/" + revision() + "/" + name)), bytes) << name;
    const Answer known = sets_.get(target(name), {{"if-none-match", "\"x\", " + whole.header("ETag")}});
    EXPECT_EQ(known.status, 304u);
    EXPECT_EQ(known.contentBytes(), 0u);
    EXPECT_EQ(sets_.get(target(name), {{"if-none-match", "\"x\""}}).status, 200u);
  }
  EXPECT_EQ(sets_.get("/v1/sets/column/CURRENT").body, current.body);
}

TEST_F(FileAnswer, RangesAreThoseOfTheFile) {
  const std::string bytes = readBytes(sets_.folder / ("column.fil/" + revision() + "/manifest.json"));
  const std::size_t n = bytes.size();
  struct Case {
    std::string range;
    std::size_t first, length;
  };
  for (const char* name : {"manifest.json", "directory.bin"}) {
    const std::string all = readBytes(sets_.folder / ("column.fil/" + revision() + "/" + name));
    const std::size_t size = all.size();
    for (const Case& c : {Case{"0-0", 0, 1},
                          {"5-9", 5, 5},
                          {"7-", 7, size - 7},
                          {"-3", size - 3, 3},
                          {"0-999999999999", 0, size},
                          {"-999999999999", 0, size}}) {
      const Answer part = sets_.get(target(name), {{"range", "bytes=" + c.range}});
      ASSERT_EQ(part.status, 206u) << c.range;
      EXPECT_EQ(contentOf(part), all.substr(c.first, c.length)) << c.range;
      EXPECT_EQ(part.header("Content-Range"), "bytes " + std::to_string(c.first) + "-" +
                                                  std::to_string(c.first + c.length - 1) + "/" + std::to_string(size));
    }
  }
  for (const std::string& range :
       {std::to_string(n) + "-", std::to_string(n) + "-" + std::to_string(n), std::string("-0")})
    EXPECT_EQ(sets_.get(target("manifest.json"), {{"range", "bytes=" + range}}).status, 416u) << range;
  // HTTP says to ignore ranges of another form.
  for (const char* range : {"bytes=5-2", "bytes=0-1,3-4", "bytes=a-b", "bytes=-", "bytes=", "lines=0-1", "bytes=1-x"})
    EXPECT_EQ(sets_.get(target("manifest.json"), {{"range", range}}).status, 200u) << range;
  EXPECT_EQ(sets_.get(target("manifest.json"), {{"range", "bytes=0-1"}, {"if-range", "\"other\""}}).status, 200u);
  const std::string tag = sets_.get(target("manifest.json")).header("ETag");
  EXPECT_EQ(sets_.get(target("manifest.json"), {{"range", "bytes=0-1"}, {"if-range", tag}}).status, 206u);
}

TEST_F(FileAnswer, EachRangeHasItsOwnAddress) {
  const std::string bytes = readBytes(sets_.folder / ("column.fil/" + revision() + "/directory.bin"));
  const Answer part = sets_.get(target("directory.bin/2-11"));
  ASSERT_EQ(part.status, 200u);
  EXPECT_EQ(contentOf(part), bytes.substr(2, 10));
  EXPECT_EQ(part.type, kBytesType);
  EXPECT_EQ(sets_.get(target("manifest.json/0-9")).type, kBytesType) << "a part of JSON is no JSON";
  EXPECT_NE(part.header("ETag"), sets_.get(target("directory.bin")).header("ETag"));
  EXPECT_EQ(sets_.get(target("directory.bin/0-" + std::to_string(bytes.size()))).status, 416u);
  for (const char* range : {"5-2", "a-b", "5", "-5", "5-", "0-18446744073709551616"})
    EXPECT_EQ(sets_.get(target("directory.bin/" + std::string(range))).status, 404u) << range;
}

TEST_F(FileAnswer, OtherNamesAreNotFound) {
  test::writeBytes(sets_.folder / ("column.fil/" + revision() + "/secret.txt"), "secret");
  test::writeBytes(sets_.folder / "secret.txt", "secret");
  for (const std::string& name :
       {std::string("secret.txt"), std::string(".."), std::string("%2E%2E%2Fsecret.txt"),
        std::string("directory.bin%00"), std::string("..%2F") + revision() + "%2Fmanifest.json",
        std::string("%2Fetc%2Fpasswd"), std::string()})
    EXPECT_EQ(sets_.get(target(name)).status, 404u) << name;
  for (const std::string target : {"/v1/sets/column/files/../secret.txt", "/v1/sets/column/files/..%2F/secret.txt",
                                   "/v1/sets/column/files/r-0000000000000000/manifest.json", "/v1/sets/column/files/x"})
    EXPECT_EQ(sets_.get(target).status, 404u) << target;
}

TEST_F(FileAnswer, ANewRevisionIsServedAndTheOldOneStays) {
  const std::string before = revision();
  const std::string old_file = target("directory.bin"), old_bytes = contentOf(sets_.get(old_file));
  CellList other(test::randomColumn(6, 3, 300, 200));
  ingest(other, sets_.folder / "column.fil", {.capacity = 128, .force = true});
  EXPECT_EQ(revision(), before);
  EXPECT_TRUE(sets_.shelf->refresh().empty());
  EXPECT_NE(revision(), before);
  EXPECT_EQ(sets_.get("/v1/sets/column/files/CURRENT").body, revision() + "\n");
  EXPECT_EQ(sets_.json("/v1/sets/column").at("cells"), 3);
  EXPECT_EQ(contentOf(sets_.get(old_file)), old_bytes);
  EXPECT_EQ(contentOf(sets_.get(target("directory.bin"))),
            readBytes(sets_.folder / ("column.fil/" + revision() + "/directory.bin")));
}

TEST_F(FileAnswer, ASetThatIsDamagedKeepsItsRevision) {
  const std::string before = revision();
  test::writeBytes(sets_.folder / "column.fil/CURRENT", "r-0000000000000000\n");
  EXPECT_EQ(sets_.shelf->refresh().size(), 1u);
  EXPECT_EQ(revision(), before);
  EXPECT_EQ(sets_.get("/readyz").body, "ready: 2 of 2 sets, 1 in the newest revision\n");
  EXPECT_EQ(sets_.get("/v1/sets/column/nearest?at=0,0,0").status, 200u);
  test::writeBytes(sets_.folder / "column.fil/CURRENT", before + "\n");
  EXPECT_TRUE(sets_.shelf->refresh().empty());
  EXPECT_EQ(sets_.get("/readyz").body, "ready: 2 of 2 sets, 2 in the newest revision\n");
}

TEST(SetShelf, TwoSetsOfOneNameAreRefused) {
  const test::ServedSets sets;
  const std::string set = sets.folder / "fork.fil";
  EXPECT_THROW(SetShelf(tools::shelfEntries({set, set + "/"}), 1 << 20), UsageError);
}

}  // namespace
}  // namespace filiform::tools
