// The page for travel: where its files lie, that only it is isolated, and what it says where it is not built.
#include "tests/support/servers/served_sets.h"

#include <fstream>
#include <string>

#include <gtest/gtest.h>

namespace filiform::tools {
namespace {

bool contains(const std::string& text, const std::string& part) { return text.find(part) != std::string::npos; }

TEST(TravelAnswer, SaysWhatToDoWhereThePageIsNotBuilt) {
  const test::ServedSets sets;
  const Answer page = sets.get("/travel/fork");
  EXPECT_EQ(page.status, 200u);
  EXPECT_TRUE(contains(page.body, "tools/setup --web")) << page.body;
  EXPECT_EQ(sets.get("/travel/page/filiform.wasm").status, 404u);
  EXPECT_EQ(sets.get("/travel/spoon").status, 404u);
}

TEST(TravelAnswer, ServesThePageAndItsFiles) {
  test::ServedSets sets;
  sets.service->web_folder = sets.folder.path();
  std::ofstream(sets.folder / "filiform.wasm") << "plain";
  std::ofstream(sets.folder / "filiform.wasm.gz") << "zipped";
  const Answer page = sets.get("/travel/fork");
  EXPECT_EQ(page.status, 200u);
  EXPECT_TRUE(contains(page.body, "data-set=\"/v1/sets/fork\"")) << page.body;
  EXPECT_FALSE(contains(page.header("Content-Security-Policy"), "unsafe-inline"));
  EXPECT_TRUE(contains(page.header("Content-Security-Policy"), "frame-ancestors 'none'"));
  const Answer plain = sets.get("/travel/page/filiform.wasm");
  EXPECT_EQ(plain.body, "plain");
  EXPECT_EQ(plain.type, "application/wasm");
  EXPECT_EQ(plain.header("Content-Encoding"), "");
  const Answer zipped = sets.get("/travel/page/filiform.wasm", {{"accept-encoding", "gzip, br"}});
  EXPECT_EQ(zipped.body, "zipped");
  EXPECT_EQ(zipped.header("Content-Encoding"), "gzip");
  EXPECT_NE(zipped.header("ETag"), plain.header("ETag"));
  const Answer known = sets.get("/travel/page/filiform.wasm", {{"if-none-match", plain.header("ETag")}});
  EXPECT_EQ(known.status, 304u);
  EXPECT_EQ(known.body, "");
  EXPECT_EQ(sets.get("/travel/page/travel.js").status, 404u) << "this folder lacks it";
}

TEST(TravelAnswer, ABrowserKeepsFilesUntilTheVersionOfThePageChanges) {
  test::ServedSets sets;
  sets.service->web_folder = sets.folder.path();
  std::ofstream(sets.folder / "filiform.wasm.gz") << "first";
  const std::string first = sets.get("/travel/fork").body;
  const std::size_t at = first.find("/travel/page/filiform.wasm?v=");
  ASSERT_NE(at, std::string::npos) << first;
  const std::string address = first.substr(at, first.find('"', at) - at);
  const std::map<std::string, std::string> zipped{{"accept-encoding", "gzip"}};
  EXPECT_TRUE(contains(sets.get(address, zipped).header("Cache-Control"), "immutable"));
  EXPECT_EQ(sets.get("/travel/page/filiform.wasm", zipped).header("Cache-Control"), "no-cache");
  EXPECT_EQ(sets.get("/travel/fork").body, first);
  std::ofstream(sets.folder / "filiform.wasm.gz") << "second";
  EXPECT_NE(sets.get("/travel/fork").body, first);
}

TEST(TravelAnswer, OnlyThePageIsIsolated) {
  test::ServedSets sets;
  sets.service->web_folder = sets.folder.path();
  std::ofstream(sets.folder / "filiform.worker.js") << "1";
  for (const char* const path : {"/travel/fork", "/travel/page/filiform.worker.js"}) {
    EXPECT_EQ(sets.get(path).header("Cross-Origin-Opener-Policy"), "same-origin") << path;
    EXPECT_EQ(sets.get(path).header("Cross-Origin-Embedder-Policy"), "require-corp") << path;
  }
  for (const char* const path : {"/", "/v1/sets/fork", "/v1/sets/fork/files/CURRENT"})
    EXPECT_EQ(sets.get(path).header("Cross-Origin-Embedder-Policy"), "") << path;
}

TEST(TravelAnswer, NeedsTheTokenButItsFilesDoNot) {
  test::ServedSets sets({.people = People::ofToken("0123456789abcdef0123"), .origins = {}, .hosts = {}});
  sets.service->web_folder = sets.folder.path();
  std::ofstream(sets.folder / "travel.js") << "1";
  EXPECT_EQ(sets.get("/travel/fork").status, 401u);
  EXPECT_EQ(sets.get("/travel/page/travel.js").status, 200u);
  const Answer redirect = sets.get("/travel/fork?token=0123456789abcdef0123");
  EXPECT_EQ(redirect.status, 303u);
  EXPECT_EQ(redirect.header("Location"), "/travel/fork");
  EXPECT_EQ(sets.get("/travel/fork?desk=an%26na&token=0123456789abcdef0123&budget=64").header("Location"),
            "/travel/fork?budget=64&desk=an%26na");
  EXPECT_TRUE(contains(redirect.header("Set-Cookie"), "HttpOnly; SameSite=Strict"));
  EXPECT_EQ(sets.get("/travel/fork?token=0123456789abcdef0124").status, 401u);
}

}  // namespace
}  // namespace filiform::tools
