// The page: what it shows, that names of files cannot change it, and what it keeps secret.
#include "index/ingest/ingest.h"
#include "tests/support/scenes/random_cells.h"
#include "tests/support/servers/served_sets.h"

#include <string>

#include <gtest/gtest.h>

namespace filiform::tools {
namespace {

const std::string kPageToken = "0123456789abcdef0123";

bool holds(const std::string& text, const std::string& part) { return text.find(part) != std::string::npos; }

TEST(PageAnswer, ShowsHowToOpenEachSet) {
  test::ServedSets sets;
  sets.service->source_url = "https://source.example/a?b=1&c=2";
  sets.service->neuroglancer = "https://ng.example/";
  const Answer page = sets.get("/", {{"host", "tiles.example:7878"}});
  EXPECT_EQ(page.status, 421u) << "the host is not this server's";
  const std::string html = sets.get("/", {{"host", "127.0.0.1:7878"}}).body;
  for (const char* part :
       {"<h2>fork</h2>", "<h2>column</h2>", "filiform view http://127.0.0.1:7878/v1/sets/fork\n",
        "precomputed://http://127.0.0.1:7878/precomputed/fork<", "catmaid://http://127.0.0.1:7878/catmaid/fork/1<",
        "href=\"https://ng.example/#!{", "import filiform as ff", "curl ",
        "href=\"https://source.example/a?b=1&amp;c=2\"", "GPL-3.0-or-later", "filiform 0.0.0"})
    EXPECT_TRUE(holds(html, part)) << part << html;
  EXPECT_FALSE(holds(html, "<img")) << "these sets have no pictures";
  EXPECT_FALSE(holds(html, "/v1/capability"));
  // A proxy with TLS.
  EXPECT_TRUE(holds(sets.get("/", {{"x-forwarded-proto", "https"}}).body, "precomputed://https://localhost/"));
  EXPECT_TRUE(holds(sets.get("/", {{"x-forwarded-proto", "javascript"}}).body, "precomputed://http://localhost/"));
}

TEST(PageAnswer, OnlyItsOwnScriptRunsInIt) {
  const test::ServedSets sets;
  const Answer page = sets.get("/");
  const std::string policy = page.header("Content-Security-Policy");
  EXPECT_TRUE(holds(policy, "default-src 'none'"));
  EXPECT_TRUE(holds(policy, "frame-ancestors 'none'"));
  EXPECT_FALSE(holds(policy, "unsafe"));
  EXPECT_TRUE(holds(policy, "script-src 'self';"));
  const std::string script = "<script src=\"/page.js\"></script>";
  ASSERT_TRUE(holds(page.body, script));
  EXPECT_EQ(page.body.find("<script"), page.body.rfind("<script"));
  EXPECT_EQ(sets.get("/page.js").type, "text/javascript; charset=utf-8");
  EXPECT_FALSE(holds(page.body, " style="));
  EXPECT_EQ(sets.get("/icon.svg").type, "image/svg+xml");
}

TEST(PageAnswer, NamesOfSetsStayText) {
  test::ServedSets sets;
  const std::string name = "<img src=x onerror=alert(1)>\"'&\x01 %2F#!";
  CellList cells(test::randomColumn(5, 1, 40, 30));
  ingest(cells, sets.folder / (name + ".fil"), {});
  sets.shelf.emplace(tools::shelfEntries({sets.folder / (name + ".fil")}), 64 << 20);
  sets.service->neuroglancer = "https://ng.example/";
  const std::string html = sets.get("/").body;
  EXPECT_FALSE(holds(html, "<img"));
  EXPECT_FALSE(holds(html, "onerror=alert(1)>"));
  EXPECT_FALSE(holds(html, "\x01"));
  EXPECT_TRUE(holds(html, "<h2>&lt;img src=x onerror=alert(1)&gt;&quot;&#39;&amp;  %2F#!</h2>")) << html;
  // Its addresses work.
  const std::string path = "/v1/sets/%3Cimg%20src%3Dx%20onerror%3Dalert%281%29%3E%22%27%26%01%20%252F%23%21";
  EXPECT_TRUE(holds(html, "href=\"" + path + "\"")) << html;
  EXPECT_EQ(sets.get(path).status, 200u);
}

TEST(PageAnswer, HoldsTheCapabilityAndNeverTheToken) {
  test::ServedSets sets({.people = People::ofToken(kPageToken), .origins = {}, .hosts = {}});
  sets.service->neuroglancer = "https://ng.example/";
  const std::string html = sets.get("/", {{"authorization", "Bearer " + kPageToken}}).body;
  EXPECT_FALSE(holds(html, kPageToken));
  EXPECT_TRUE(
      holds(html, "/precomputed/~" + sets.access.capability(*People::ofToken(kPageToken).all().front()) + "/fork"));
  EXPECT_TRUE(
      holds(html, "/catmaid/~" + sets.access.capability(*People::ofToken(kPageToken).all().front()) + "/fork/1"));
  EXPECT_TRUE(holds(html, "-X DELETE"));
  const Answer redirect = sets.get("/?token=" + kPageToken);
  EXPECT_EQ(redirect.status, 303u);
  EXPECT_EQ(redirect.header("Location"), "/");
  EXPECT_TRUE(holds(redirect.header("Set-Cookie"), "HttpOnly; SameSite=Strict"));
}

}  // namespace
}  // namespace filiform::tools
