// The people whom the operator names: their file, what they may do and see.
#include "tools/serve/people/people.h"

#include "index/errors.h"
#include "index/file/signature.h"
#include "tests/support/servers/served_sets.h"
#include "tests/support/temp_folder.h"
#include "tools/serve/sets/set_catalogue.h"

#include <map>
#include <string>
#include <vector>

#include <gtest/gtest.h>

namespace filiform::tools {
namespace {

const std::string kAnn = "0123456789abcdef-ann", kBen = "0123456789abcdef-ben", kCarl = "0123456789abcdef-carl";
using Headers = std::map<std::string, std::string>;

Headers bearer(const std::string& token) { return {{"authorization", "Bearer " + token}}; }

People read(const test::TempFolder& folder, const std::string& text) {
  test::writeBytes(folder / "people.toml", text);
  return readPeople(folder / "people.toml");
}

TEST(People, AreReadFromAFile) {
  const test::TempFolder folder;
  const People people = read(folder, "[[token]]\nname = \"ann\"\ntoken = \"" + kAnn +
                                         "\"\nscopes = [\"read\", \"metrics\"]\nsets = [\"column\", \"pilot-*\"]\n"
                                         "requests-per-minute = 600\n"
                                         "[[token]]\nname = \"ben\"\nsha256 = \"" +
                                         sha256Digits(kBen) +
                                         "\"\n[[user]]\nname = \"*@lab.example\"\nsets = []\n"
                                         "[[user]]\nname = \"*\"\nscopes = [\"session\"]\n"
                                         "[anonymous]\nsets = [\"public\"]\n");
  EXPECT_FALSE(people.isOpen());
  EXPECT_EQ(people.all().size(), 4u);
  const PersonPointer ann = people.byToken(kAnn), ben = people.byToken(kBen);
  ASSERT_TRUE(ann != nullptr && ben != nullptr);
  EXPECT_EQ(people.byToken(kAnn + "x"), nullptr);
  EXPECT_EQ(people.byToken(""), nullptr);
  EXPECT_EQ(people.byToken(sha256Digits(kBen)), nullptr) << "the digest opens nothing";
  EXPECT_EQ(ann->name, "ann");
  EXPECT_EQ(ann->requests_per_minute, 600u);
  EXPECT_TRUE(ann->may(Scope::read) && ann->may(Scope::metrics) && ann->may(Scope::open));
  EXPECT_FALSE(ann->may(Scope::session) || ann->may(Scope::revoke));
  EXPECT_TRUE(ann->sees("column", {}) && ann->sees("pilot-2", {}) && ann->sees("column", {"a*"}));
  EXPECT_FALSE(ann->sees("columns", {}) || ann->sees("column", {"ben"}));
  EXPECT_TRUE(ben->may(Scope::read) && ben->may(Scope::session));
  EXPECT_FALSE(ben->may(Scope::metrics) || ben->may(Scope::revoke)) << "only what the file says";
  EXPECT_TRUE(ben->seesAll());
  const PersonPointer eve = people.user("eve@lab.example"), other = people.user("other");
  EXPECT_EQ(eve->name, "eve@lab.example");
  EXPECT_EQ(eve->entry, "*@lab.example");
  EXPECT_FALSE(eve->sees("column", {}));
  EXPECT_TRUE(other->sees("column", {}) && other->may(Scope::session));
  EXPECT_FALSE(other->may(Scope::read));
  EXPECT_TRUE(people.anonymous()->sees("public", {}));
  EXPECT_FALSE(people.anonymous()->sees("column", {}));
}

TEST(People, MistakesInTheFileNameTheirLine) {
  const test::TempFolder folder;
  const std::string token = "token = \"" + kAnn + "\"\n";
  const std::vector<std::vector<std::string>> mistakes{
      {"", "has no [[token]]"},
      {"[[token]\n", "line 1", "--tokens"},
      {"[[token]]\n" + token, "line 1", "needs a name"},
      {"[[token]]\nname = \"ann\"\n", "line 1", "'ann'", "token or sha256"},
      {"[[token]]\nname = \"ann\"\n" + token + "sha256 = \"" + sha256Digits(kBen) + "\"\n", "either"},
      {"[[token]]\nname = \"ann\"\ntoken = \"short\"\n", "line 3", "16 to 512"},
      {"[[token]]\nname = \"ann\"\nsha256 = \"" + kAnn + "\"\n", "line 3", "sha256sum"},
      {"[[token]]\nname = \"ann lee\"\n" + token, "line 2", "without blanks"},
      {"[[token]]\nname = \"anonymous\"\n" + token, "anonymous"},
      {"[[token]]\nname = \"ann\"\n" + token + "scopes = [\"write\"]\n", "line 4", "'write'", "revoke"},
      {"[[token]]\nname = \"ann\"\n" + token + "scopes = \"read\"\n", "line 4", "list"},
      {"[[token]]\nname = \"ann\"\n" + token + "sets = [7]\n", "line 4", "quotation marks"},
      {"[[token]]\nname = \"ann\"\n" + token + "requests-per-minute = 0\n", "line 4", "at least 1"},
      {"[[token]]\nname = \"ann\"\n" + token + "qouta = 1\n", "line 4", "'qouta'", "requests-per-minute"},
      {"[[token]]\nname = \"ann\"\n" + token + "[[token]]\nname = \"ben\"\n" + token, "line 4", "'ben'"},
      {"[[user]]\nname = \"ann\"\n" + token, "line 3", "'token'"},
      {"[anonymous]\nname = \"x\"\n", "line 2", "'name'"},
      {"[token]\nname = \"ann\"\n", "line 1", "list"},
      {"[tokens]\n", "line 1", "'tokens'", "[[token]]"}};
  for (const auto& words : mistakes) {
    try {
      read(folder, words[0]);
      ADD_FAILURE() << words[0];
    } catch (const UsageError& error) {
      for (std::size_t i = 1; i < words.size(); ++i)
        EXPECT_NE(std::string(error.what()).find(words[i]), std::string::npos) << words[0] << error.what();
      EXPECT_EQ(std::string(error.what()).find(kAnn), std::string::npos) << "a token in a message: " << error.what();
    }
  }
  EXPECT_THROW(readPeople(folder / "absent.toml"), IoError);
}

// Served: column and fork. Ann sees column alone, Ben all, Carl reads nothing but /metrics.
class ServedPeople : public ::testing::Test {
 protected:
  static AccessRules rules() {
    People people = People::listed();
    people.add({.name = "ann", .entry = "ann", .scopes = {Scope::read, Scope::metrics}, .sets = {"col*"}},
               sha256Digits(kAnn));
    people.add({.name = "ben", .entry = "ben"}, sha256Digits(kBen));
    people.add({.name = "carl", .entry = "carl", .scopes = {Scope::metrics}, .requests_per_minute = 3},
               sha256Digits(kCarl));
    people.addUsers({.entry = "*@lab.example", .scopes = {Scope::read}, .sets = {"fork"}});
    return {.people = people, .origins = {}, .hosts = {}};
  }
  static bool holds(const std::string& text, const char* part) { return text.find(part) != std::string::npos; }
  test::ServedSets sets{rules()};
};

// Else names of sets could be tried.
TEST_F(ServedPeople, AHiddenSetIsAsIfItWereNotThere) {
  const std::string revision = sets.shelf->find("fork")->set().revision();
  for (const std::string& rest :
       {std::string(""), std::string("/nearest?at=1,2,3"), std::string("/nearest?at=1,2"), std::string("/cells"),
        std::string("/cells/fork.json"), std::string("/files/CURRENT"), "/files/" + revision + "/cells.bin",
        "/" + revision + "/cells.bin", std::string("/picture"), std::string("/measures"), std::string("/box?lo=1"),
        std::string("/desks/d1"), std::string("/nothing"), std::string("/cells?x=1")}) {
    const Answer hidden = sets.get("/v1/sets/fork" + rest, bearer(kAnn));
    const Answer absent = sets.get("/v1/sets/gone" + rest, bearer(kAnn));
    std::string as_absent = hidden.body;
    if (const std::size_t at = as_absent.find("'fork'"); at != std::string::npos) as_absent.replace(at, 6, "'gone'");
    EXPECT_EQ(hidden.status, absent.status) << rest;
    EXPECT_EQ(as_absent, absent.body) << rest;
    EXPECT_EQ(hidden.headers, absent.headers) << rest;
    EXPECT_NE(hidden.status, 200u) << rest;
  }
  for (const char* target : {"/travel/fork", "/precomputed/fork/info", "/catmaid/fork/version"})
    EXPECT_EQ(sets.get(target, bearer(kAnn)).status, 404u) << target;
  EXPECT_EQ(sets.get("/travel/fork?token=" + kAnn).status, 404u);
  const std::string tag = sets.get("/v1/sets/fork", bearer(kBen)).header("ETag");
  EXPECT_EQ(sets.get("/v1/sets/fork", {{"authorization", "Bearer " + kBen}, {"if-none-match", tag}}).status, 304u);
  EXPECT_EQ(sets.get("/v1/sets/fork", {{"authorization", "Bearer " + kAnn}, {"if-none-match", tag}}).status, 404u);
  EXPECT_EQ(sets.get("/v1/sets/column", bearer(kAnn)).status, 200u);
}

TEST_F(ServedPeople, ListsNameOnlyWhatThePersonMaySee) {
  for (const char* target : {"/", "/v1/sets", "/metrics", "/v1/openapi.json"}) {
    const Answer of_ann = sets.get(target, bearer(kAnn)), of_ben = sets.get(target, bearer(kBen));
    EXPECT_EQ(of_ann.status, 200u) << target;
    EXPECT_FALSE(holds(of_ann.body, "fork")) << target;
    EXPECT_EQ(holds(of_ben.body, "fork"), std::string(target) != "/v1/openapi.json") << target;
  }
  sets.metrics.count("/", 200, 0.1, 1, 1, "ann");
  sets.metrics.count("/", 200, 0.1, 1, 1, "ben");
  const std::string of_ann = sets.get("/metrics", bearer(kAnn)).body, of_ben = sets.get("/metrics", bearer(kBen)).body;
  EXPECT_TRUE(holds(of_ann, "filiform_person_requests_total{person=\"ann\"} 1\n")) << of_ann;
  EXPECT_FALSE(holds(of_ann, "person=\"ben\""));
  EXPECT_TRUE(holds(of_ben, "person=\"ben\"") && holds(of_ben, "person=\"ann\""));
}

TEST_F(ServedPeople, ScopesSayWhatTheyMayDo) {
  EXPECT_EQ(sets.get("/metrics", bearer(kCarl)).status, 200u);
  const Answer refused = sets.get("/v1/sets", bearer(kCarl));
  EXPECT_EQ(refused.status, 403u);
  EXPECT_TRUE(holds(refused.body, "'read'")) << refused.body;
  EXPECT_EQ(sets.get("/v1/session", bearer(kAnn)).status, 403u);
  EXPECT_EQ(sets.get("/v1/session", bearer(kBen)).status, 426u);
  EXPECT_EQ(sets.get("/v1/sets/column/desks/d", bearer(kAnn)).status, 403u);
  EXPECT_EQ(sets.ask("DELETE", "/v1/capability", bearer(kAnn)).status, 403u);
  EXPECT_EQ(sets.ask("DELETE", "/v1/capability", bearer(kBen)).status, 200u);
  EXPECT_EQ(sets.metrics.refused_tokens, 0u);
}

TEST_F(ServedPeople, ALinkShowsWhatItsPersonMaySee) {
  const auto link = [&](const Headers& who) {
    return nlohmann::json::parse(sets.get("/v1/capability", who).body).at("precomputed").get<std::string>();
  };
  const std::string of_ann = link(bearer(kAnn)), of_ben = link(bearer(kBen));
  EXPECT_NE(of_ann, of_ben);
  EXPECT_EQ(sets.get(of_ann + "column/info").status, 200u);
  EXPECT_EQ(sets.get(of_ann + "fork/info").status, 404u);
  EXPECT_EQ(sets.get(of_ben + "fork/info").status, 200u);
  sets.ask("DELETE", "/v1/capability", bearer(kBen));
  EXPECT_EQ(sets.get(of_ben + "fork/info").status, 401u);
  EXPECT_EQ(sets.get(of_ann + "column/info").status, 200u) << "others keep theirs";
}

TEST_F(ServedPeople, AQuotaIsRefusedWithATime) {
  for (int i = 0; i < 3; ++i) EXPECT_EQ(sets.get("/metrics", bearer(kCarl)).status, 200u);
  const Answer refused = sets.get("/metrics", bearer(kCarl));
  EXPECT_EQ(refused.status, 429u);
  EXPECT_EQ(refused.header("Retry-After"), "20");
  EXPECT_TRUE(holds(refused.body, "3 requests a minute")) << refused.body;
  EXPECT_EQ(sets.metrics.refused_quotas, 1u);
  EXPECT_EQ(sets.get("/metrics", bearer(kBen)).status, 200u);
}

TEST_F(ServedPeople, UsersOfAProxyComeBeforeTokens) {
  sets.user = "eve@lab.example";
  EXPECT_EQ(sets.get("/v1/sets/fork").status, 200u);
  EXPECT_EQ(sets.get("/v1/sets/column").status, 404u);
  EXPECT_EQ(sets.get("/v1/sets/column", bearer("a token for the proxy")).status, 404u);
  EXPECT_EQ(sets.get("/v1/session").status, 403u);
  const std::string link = nlohmann::json::parse(sets.get("/v1/capability").body).at("precomputed");
  sets.user = "eve@elsewhere.example";
  const Answer refused = sets.get("/v1/sets");
  EXPECT_EQ(refused.status, 403u);
  EXPECT_TRUE(holds(refused.body, "[[user]]")) << refused.body;
  sets.user = "";
  EXPECT_EQ(sets.get("/v1/sets").status, 401u) << "nobody is anonymous here";
  EXPECT_EQ(sets.get(link + "fork/info").status, 200u);
  EXPECT_EQ(sets.get(link + "column/info").status, 404u);
  // A cookie is of a token; nobody else gets one.
  EXPECT_EQ(sets.get("/?token=" + kAnn).status, 303u);
}

TEST_F(ServedPeople, TheCatalogueNamesReaders) {
  const test::TempFolder folder;
  test::writeBytes(folder / "sets.toml", "[fork]\naddress = \"" + sets.folder / "fork.fil" +
                                             "\"\nreaders = [\"ben\", \"*@lab.example\"]\n[column]\naddress = \"" +
                                             sets.folder / "column.fil" + "\"\nreaders = [\"ann\"]\n");
  const auto before = sets.shelf->find("fork");
  sets.shelf->replace(readCatalogue(folder / "sets.toml"));
  EXPECT_EQ(sets.shelf->find("fork"), before) << "new readers do not open a set again";
  EXPECT_EQ(sets.get("/v1/sets/column", bearer(kBen)).status, 404u);
  EXPECT_EQ(sets.get("/v1/sets/fork", bearer(kBen)).status, 200u);
  EXPECT_EQ(sets.get("/v1/sets/column", bearer(kAnn)).status, 200u);
  sets.user = "eve@lab.example";
  EXPECT_EQ(sets.get("/v1/sets/fork").status, 200u);
  test::writeBytes(folder / "sets.toml", "[fork]\naddress = \"x\"\nreaders = []\n");
  EXPECT_THROW(readCatalogue(folder / "sets.toml"), UsageError);
}

TEST(People, ALinkOfUsersShowsNoSetThatHasReaders) {
  People people = People::listed();
  people.addUsers({.entry = "*"});
  test::ServedSets sets({.people = people, .origins = {}, .hosts = {}});
  ShelfEntry fork{.name = "fork", .path = sets.folder / "fork.fil", .readers = {"ann"}};
  const ShelfEntry column{.name = "column", .path = sets.folder / "column.fil"};
  sets.shelf->replace({fork, column});
  sets.user = "ann";
  EXPECT_EQ(sets.get("/v1/sets/fork").status, 200u);
  sets.user = "bob";
  EXPECT_EQ(sets.get("/v1/sets/fork").status, 404u);
  const std::string link = nlohmann::json::parse(sets.get("/v1/capability").body).at("precomputed");
  sets.user = "";
  EXPECT_EQ(sets.get(link + "column/info").status, 200u);
  EXPECT_EQ(sets.get(link + "fork/info").status, 404u);
  // What was for ann stays so until the set that takes its name can be opened.
  fork.path = sets.folder / "gone.fil";
  fork.readers = {};
  sets.shelf->replace({fork, column});
  sets.user = "bob";
  EXPECT_EQ(sets.get("/v1/sets/fork").status, 404u);
  sets.user = "ann";
  EXPECT_EQ(sets.get("/v1/sets/fork").status, 200u);
}

TEST(People, SomeSetsMayBeForEverybody) {
  People people = People::listed();
  people.add({.name = "ben", .entry = "ben"}, sha256Digits(kBen));
  people.setAnonymous({.scopes = {Scope::read}, .sets = {"fork"}});
  const test::ServedSets sets({.people = people, .origins = {}, .hosts = {}});
  EXPECT_EQ(sets.get("/v1/sets/fork").status, 200u);
  EXPECT_EQ(sets.get("/v1/sets/column").status, 404u);
  EXPECT_EQ(sets.get("/precomputed/fork/info").status, 200u) << "without a capability";
  EXPECT_EQ(sets.get("/metrics").status, 403u);
  EXPECT_EQ(sets.get("/v1/sets", bearer("wrong")).status, 401u);
  EXPECT_EQ(sets.get("/v1/sets/column", bearer(kBen)).status, 200u);
}

}  // namespace
}  // namespace filiform::tools
