// The sets of a server: their names, those that cannot be read, the catalogue, and open files.
#include "tools/serve/sets/set_shelf.h"

#include "index/errors.h"
#include "tests/support/servers/served_sets.h"
#include "tests/support/temp_folder.h"
#include "tools/serve/sets/open_files.h"
#include "tools/serve/sets/set_catalogue.h"

#include <filesystem>
#include <string>
#include <vector>

#include <gtest/gtest.h>

namespace filiform::tools {
namespace {

TEST(SetShelf, ASetMayHaveANameOfItsOwn) {
  const std::vector<ShelfEntry> entries =
      shelfEntries({"/a/column.fil", "far=http://a/v1/sets/column", "s3://b/x=y/column.fil", "/odd=name.fil"});
  ASSERT_EQ(entries.size(), 4u);
  EXPECT_EQ(entries[0].name, "column");
  EXPECT_EQ(entries[1].name, "far");
  EXPECT_EQ(entries[1].path, "http://a/v1/sets/column");
  EXPECT_EQ(entries[2].name, "column");
  EXPECT_EQ(entries[2].path, "s3://b/x=y/column.fil");
  EXPECT_EQ(entries[3].name, "odd=name");
  try {
    const SetShelf shelf(shelfEntries({"http://a/v1/sets/column", "http://b/v1/sets/column"}), 1 << 20);
    FAIL();
  } catch (const UsageError& error) {
    EXPECT_NE(std::string(error.what()).find("NAME=http://b/v1/sets/column"), std::string::npos) << error.what();
  }
}

TEST(SetShelf, MemoryGoesToTheSetsThatAreAskedFor) {
  const test::ServedSets sets;
  const std::vector<ShelfEntry> entries =
      shelfEntries({sets.folder / "column.fil", "second=" + sets.folder / "column.fil"});
  const auto kept = [](const SetShelf& shelf) {
    const Nearest& nearest = shelf.all().front()->nearest();
    for (int x = -200; x <= 500; x += 10)
      for (int z = -200; z <= 500; z += 50) nearest.find({1.0 * x, 0, 1.0 * z});
    return nearest.bytes();
  };
  const std::uint64_t all = kept(SetShelf(entries, std::uint64_t{1} << 30));
  SetShelf shelf(entries, 8 * all);  // three eighths of a set's part are for searches
  EXPECT_EQ(kept(shelf), all);
  ASSERT_NE(shelf.find("second"), nullptr);
  shelf.refresh();  // the first one was never asked for: an eighth of the budget, and of that three eighths
  EXPECT_LT(shelf.all().front()->nearest().bytes(), all);
  EXPECT_LT(kept(shelf), all);
  ASSERT_NE(shelf.find("column"), nullptr);
  shelf.refresh();
  EXPECT_EQ(kept(shelf), all);
}

TEST(SetShelf, ServesWhatCanBeReadAndSaysWhatCannot) {
  test::ServedSets sets;
  const std::string good = sets.folder / "fork.fil", late = sets.folder / "late.fil";
  SetShelf shelf(shelfEntries({good, late, "gone=" + sets.folder / "gone.fil"}), 8 << 20);
  const Service service{shelf, sets.access, sets.metrics, "0.0.0"};
  const Routes routes(service, [](const std::string&) {});
  const auto get = [&](const char* target) {
    Request request;
    request.method = "GET";
    request.target = target;
    request.headers["host"] = "localhost";
    return routes.answer(request).answer;
  };
  EXPECT_EQ(shelf.problems().size(), 2u);
  EXPECT_EQ(get("/readyz").body, "ready: 1 of 3 sets, 1 in the newest revision\n");
  EXPECT_EQ(get("/v1/sets/fork").status, 200u);
  EXPECT_EQ(get("/v1/sets/late").status, 503u);
  EXPECT_EQ(get("/v1/sets/other").status, 404u);
  const std::string metrics = get("/metrics").body;
  EXPECT_NE(metrics.find("filiform_set_ready{set=\"fork\"} 1\n"), std::string::npos) << metrics;
  EXPECT_NE(metrics.find("filiform_set_open{set=\"gone\"} 0\n"), std::string::npos) << metrics;
  std::filesystem::copy(sets.folder / "column.fil", late, std::filesystem::copy_options::recursive);
  auto entries = shelfEntries({good, late});
  const auto kept = shelf.find("fork");
  shelf.replace(entries);
  EXPECT_EQ(shelf.find("fork"), kept) << "an entry that is as it was is not opened again";
  shelf.replace(shelfEntries({"fork=" + sets.folder / "gone.fil", late}));
  EXPECT_EQ(shelf.find("fork"), kept) << "a set that cannot be opened keeps what was served";
  EXPECT_EQ(shelf.problems().size(), 1u);
  shelf.replace(entries);
  EXPECT_EQ(get("/v1/sets/late").status, 200u);
  EXPECT_FALSE(shelf.has("gone"));
  EXPECT_NE(get("/metrics").body.find("filiform_set_requests_total{set=\"late\"} 2\n"), std::string::npos)
      << "one before the set could be opened; " << get("/metrics").body;
  entries.push_back(entries.front());
  EXPECT_THROW(shelf.replace(entries), UsageError);
  EXPECT_EQ(shelf.states().size(), 2u) << "nothing changed";
  EXPECT_THROW(SetShelf(shelfEntries({sets.folder / "gone.fil"}), 1 << 20), IoError) << "nothing to serve";
}

TEST(SetCatalogue, ATableIsASet) {
  const test::TempFolder folder;
  test::writeBytes(folder / "token", "0123456789abcdef\n");
  const auto read = [&](const std::string& text) {
    test::writeBytes(folder / "sets.toml", text);
    return readCatalogue(folder / "sets.toml");
  };
  const std::vector<ShelfEntry> entries = read(
      "# the lab's\n[column]\naddress = \"sub/column.fil\"\nbudget = \"2GiB\"\n[\"far.away\"]\naddress = "
      "\"s3://sets/a.fil\"\ntoken-file = \"token\"\n");
  ASSERT_EQ(entries.size(), 2u);
  EXPECT_EQ(entries[0].name, "column");
  EXPECT_EQ(entries[0].path, folder / "sub/column.fil");
  EXPECT_EQ(entries[0].budget_bytes, std::uint64_t{2} << 30);
  EXPECT_EQ(entries[1].name, "far.away");
  EXPECT_EQ(entries[1].path, "s3://sets/a.fil");
  EXPECT_EQ(entries[1].remote.token, "0123456789abcdef");
  EXPECT_TRUE(read("").empty());
  const std::vector<std::vector<std::string>> mistakes{
      {"[column]\naddress = \"a.fil\"\nbudgte = \"1GiB\"\n", "line 3", "budgte"},
      {"[column]\n", "line 1", "address"},
      {"x = 1\n", "line 1", "[NAME]"},
      {"[column]\naddress = 7\n", "line 2", "quotation marks"},
      {"[column\n", "line 1", "--catalogue"},
      {"[a]\naddress = \"a\"\n[a]\naddress = \"b\"\n", "line 3", "a"}};
  for (const auto& words : mistakes) {
    try {
      read(words[0]);
      ADD_FAILURE() << words[0];
    } catch (const UsageError& error) {
      for (std::size_t i = 1; i < words.size(); ++i)
        EXPECT_NE(std::string(error.what()).find(words[i]), std::string::npos) << words[0] << error.what();
    }
  }
  EXPECT_THROW(readCatalogue(folder / "absent.toml"), IoError);
}

TEST(OpenFiles, SetsAndClientsShareTheLimit) {
  EXPECT_EQ(filesOfSet(4096, 1, 256), 512u);
  EXPECT_GE(filesOfSet(4096, 100, 256), 36u);
  EXPECT_EQ(filesOfSet(1168, 100, 256), 8u);
  for (const auto& [limit, sets, clients] :
       std::vector<std::array<std::size_t, 3>>{{256, 1, 5000}, {1024, 400, 256}, {64, 100, 5}}) {
    try {
      filesOfSet(limit, sets, clients);
      ADD_FAILURE() << limit;
    } catch (const UsageError& error) {
      const std::string text = error.what();
      // The advice can be followed.
      if (const std::size_t at = text.find("--max-clients "); at != std::string::npos)
        EXPECT_NO_THROW(filesOfSet(limit, sets, std::stoul(text.substr(at + 14)))) << text;
      else if (const std::size_t most = text.find("at most "); most != std::string::npos)
        EXPECT_NO_THROW(filesOfSet(limit, std::stoul(text.substr(most + 8)), clients)) << text;
      else
        ADD_FAILURE() << text;
    }
  }
}

}  // namespace
}  // namespace filiform::tools
