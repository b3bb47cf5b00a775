// The door for Neuroglancer: the skeletons are the cells of the set, and who may read them.
#include "index/ingest/ingest.h"
#include "index/input/input.h"
#include "index/query/cell_graph.h"
#include "tests/support/servers/served_sets.h"

#include <bit>
#include <cmath>
#include <cstring>
#include <string>

#include <gtest/gtest.h>

namespace filiform::tools {
namespace {

using Json = nlohmann::json;

const std::string kDoorToken = "0123456789abcdef0123";

template <typename Value>
Value valueAt(const std::string& bytes, std::size_t at) {
  Value value;
  std::memcpy(&value, bytes.data() + at, sizeof value);
  return value;
}

TEST(PrecomputedAnswer, SkeletonsAreTheCells) {
  const test::ServedSets sets;
  const auto served = sets.shelf->find("column");
  const Json info = sets.json("/precomputed/column/info");
  EXPECT_EQ(info.at("@type"), "neuroglancer_skeletons");
  EXPECT_FALSE(info.contains("sharding"));
  const auto& transform = info.at("transform");
  const double quantum_um = served->set().grid().quantum_um();
  for (std::uint32_t cell = 0; cell < served->set().cell_count(); ++cell) {
    const CellGraph graph = readCell(served->set(), cell, true);
    const Answer answer = sets.get("/precomputed/column/" + std::to_string(cell + 1));
    ASSERT_EQ(answer.status, 200u) << answer.body;
    const std::string& bytes = answer.body;
    const auto vertices = valueAt<std::uint32_t>(bytes, 0), edges = valueAt<std::uint32_t>(bytes, 4);
    ASSERT_EQ(vertices, graph.samples());
    ASSERT_EQ(edges, parentLinks(graph).size());
    ASSERT_EQ(bytes.size(), 8 + vertices * 20u + edges * 8u);
    for (std::uint32_t i = 0; i < vertices; ++i) {
      for (std::size_t axis = 0; axis < 3; ++axis) {
        const double stored = valueAt<float>(bytes, 8 + (i * 3 + axis) * 4);
        const double nm = stored * transform[axis * 5].get<double>() + transform[axis * 4 + 3].get<double>();
        ASSERT_EQ(nm, graph.position_W(i)[static_cast<Eigen::Index>(axis)] * 1e3);
      }
      const auto radius = valueAt<float>(bytes, 8 + vertices * 12u + edges * 8u + i * 4u);
      if (std::isnan(graph.radii_um[i])) {
        ASSERT_TRUE(std::isnan(radius)) << radius << ", of an unknown radius";
      } else {
        ASSERT_NEAR(radius * quantum_um, graph.radii_um[i], 1e-6) << "the unit of the vertices";
      }
      ASSERT_EQ(valueAt<float>(bytes, 8 + vertices * 16u + edges * 8u + i * 4u), graph.types[i]);
    }
  }
  for (const char* absent : {"0", "11", "x", "01", "+1", "1.0", "99999999999999999999"})
    EXPECT_EQ(sets.get(std::string("/precomputed/column/") + absent).status, 404u) << absent;
}

TEST(PrecomputedAnswer, PropertiesNameTheCells) {
  const test::ServedSets sets;
  const Json inside = sets.json("/precomputed/fork/segment_properties/info").at("inline");
  EXPECT_EQ(inside.at("ids"), (Json{"1", "2"}));
  for (const auto& property : inside.at("properties")) {
    if (property.at("type") == "label") {
      EXPECT_EQ(property.at("values"), (Json{"fork", "square"}));
    }
    if (property.at("id") == "segments") {
      EXPECT_EQ(property.at("values"), (Json{4, 5}));
    }
  }
}

TEST(PrecomputedAnswer, NamesThatAreNumbersAreTheIds) {
  test::ServedSets sets;
  const std::string swc = "1 1 0 0 0 1 -1\n2 3 1 0 0 1 1\n";
  for (const char* name : {"720575940626286432", "18446744073709551615"})
    test::writeBytes(sets.folder / (std::string(name) + ".swc"), swc + "3 3 2 0 0 1 2\n# " + name + "\n");
  Input input({sets.folder / "720575940626286432.swc", sets.folder / "18446744073709551615.swc"});
  ingest(input, sets.folder / "numbers.fil", {});
  sets.shelf.emplace(tools::shelfEntries({sets.folder / "numbers.fil"}), 64 << 20);
  EXPECT_EQ(sets.get("/precomputed/numbers/720575940626286432").status, 200u);
  EXPECT_EQ(sets.get("/precomputed/numbers/18446744073709551615").status, 200u);
  EXPECT_EQ(sets.get("/precomputed/numbers/1").status, 404u);
  EXPECT_EQ(sets.json("/precomputed/numbers/segment_properties/info").at("inline").at("ids").size(), 2u);
}

TEST(PrecomputedAnswer, ARevisionIsReadOnce) {
  const test::ServedSets sets;
  const Answer first = sets.get("/precomputed/fork/1");
  const std::string tag = first.header("ETag");
  ASSERT_FALSE(tag.empty());
  const Answer again = sets.get("/precomputed/fork/1", {{"if-none-match", tag}});
  EXPECT_EQ(again.status, 304u);
  EXPECT_TRUE(again.body.empty());
  EXPECT_EQ(sets.get("/precomputed/fork/1", {{"if-none-match", "\"other\""}}).status, 200u);
  EXPECT_EQ(sets.get("/precomputed/fork/9", {{"if-none-match", tag}}).status, 404u);
}

TEST(Capability, OpensTheDoorsAloneAndCanBeRevoked) {
  const test::ServedSets sets({.people = People::ofToken(kDoorToken), .origins = {"https://ng.example"}, .hosts = {}});
  const std::map<std::string, std::string> bearer{{"authorization", "Bearer " + kDoorToken}};
  const Json json = Json::parse(sets.get("/v1/capability", bearer).body);
  const std::string door = json.at("precomputed"), catmaid = json.at("catmaid");
  EXPECT_EQ(door, "/precomputed/~" + json.at("capability").get<std::string>() + "/");
  EXPECT_EQ(json.dump().find(kDoorToken), std::string::npos);
  for (const std::string& target : {door + "fork/info", door + "fork/1", catmaid + "fork/version",
                                    catmaid + "fork/accounts/anonymous-api-token", catmaid + "fork/1/skeletons/"}) {
    EXPECT_EQ(sets.get(target).status, 200u) << target;
    // CATMAID's clients send the token that they got.
    EXPECT_EQ(sets.get(target, {{"authorization", "Token anonymous"}}).status, 200u) << target;
    EXPECT_EQ(sets.get(target, {{"host", "evil.example"}}).status, 421u) << target;
    EXPECT_EQ(sets.get(target, {{"origin", "https://evil.example"}}).status, 403u) << target;
    EXPECT_EQ(sets.get(target, {{"origin", "https://ng.example"}}).header("Access-Control-Allow-Origin"),
              "https://ng.example");
    EXPECT_EQ(sets.get(target, {{"origin", "https://ng.example"}}).body.find(kDoorToken), std::string::npos);
  }
  // Nothing else opens: no other route, no other text, no door without it.
  for (const std::string& target :
       {std::string("/precomputed/fork/info"), std::string("/catmaid/fork/version"),
        std::string("/precomputed/~/fork/info"), std::string("/precomputed/~x/fork/info"),
        door.substr(0, door.size() - 2) + "/fork/info", "/v1/~" + json.at("capability").get<std::string>() + "/sets",
        "/precomputed/~" + kDoorToken + "/fork/info", std::string("/v1/capability")})
    EXPECT_EQ(sets.get(target).status, 401u) << target;
  EXPECT_EQ(sets.get("/precomputed/fork/info", bearer).status, 200u);
  EXPECT_EQ(sets.get(door + "none/info").status, 404u);

  EXPECT_EQ(sets.ask("DELETE", "/v1/capability", {}).status, 401u);
  EXPECT_EQ(sets.ask("DELETE", "/v1/capability",
                     {{"authorization", "Bearer " + kDoorToken}, {"origin", "https://evil.example"}})
                .status,
            403u);
  EXPECT_EQ(sets.get(door + "fork/info").status, 200u);
  const Json fresh = Json::parse(sets.ask("DELETE", "/v1/capability", bearer).body);
  EXPECT_NE(fresh.at("capability"), json.at("capability"));
  EXPECT_EQ(sets.get(door + "fork/info").status, 401u);
  EXPECT_EQ(sets.get(fresh.at("precomputed").get<std::string>() + "fork/info").status, 200u);
}

TEST(Capability, NeedsAToken) {
  const test::ServedSets sets;
  EXPECT_EQ(sets.json("/v1/capability").at("capability"), nullptr);
  EXPECT_EQ(sets.ask("DELETE", "/v1/capability", {}).status, 400u);
  EXPECT_EQ(sets.get("/precomputed/~/fork/info").status, 404u);
  EXPECT_EQ(sets.get("/precomputed/fork/info").status, 200u);
}

}  // namespace
}  // namespace filiform::tools
