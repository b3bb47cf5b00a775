// A client that makes the eight GETs of CATMAID's interface, as Neuroglancer's spatially indexed skeletons do, and
// checks its limits: nodes are int32, skeletons and cubes uint32.
#include "index/ingest/ingest.h"
#include "index/query/cell_graph.h"
#include "tests/support/scenes/random_cells.h"
#include "tests/support/servers/served_sets.h"
#include "tools/serve/sets/catmaid_space.h"

#include <array>
#include <cmath>
#include <map>
#include <set>
#include <string>

#include <gtest/gtest.h>

namespace filiform::tools {
namespace {

using Json = nlohmann::json;

class CatmaidClient {
 public:
  CatmaidClient(const test::ServedSets& sets, const std::string& set) : sets_(sets), base_("/catmaid/" + set) {
    token_ = ask("/accounts/anonymous-api-token").at("token");
    version_ = ask("/version").at("SERVER_VERSION");
    stack_ = ask("/1/stack/" + std::to_string(ask("/1/stacks").at(0).at("id").get<int>()) + "/info");
    skeletons_ = ask("/1/skeletons/");
  }
  Json ask(const std::string& path) const {
    const Answer answer = sets_.get(
        base_ + path, token_.empty() ? std::map<std::string, std::string>{}
                                     : std::map<std::string, std::string>{{"authorization", "Token " + token_}});
    EXPECT_EQ(answer.status, 200u) << path << answer.body;
    return Json::parse(answer.body);
  }

  struct Found {
    std::map<std::int64_t, Json> nodes;                          // by id; of several rows, one with a parent
    std::multiset<std::pair<std::int64_t, std::int64_t>> links;  // as drawn: both ends in one answer
    std::size_t cubes = 0, most = 0;
  };
  // Asks for all cubes of a level, as the client does: at multiples of the edge, rounded outwards to whole nm.
  Found browse(std::size_t level) const {
    const auto& spatial = stack_.at("metadata").at("spatial");
    const auto edge = spatial.at(level).at("chunk_size").at(0).get<std::int64_t>();
    std::array<std::int64_t, 3> first{}, last{};
    const std::array<const char*, 3> axes{"x", "y", "z"};
    for (std::size_t axis = 0; axis < 3; ++axis) {
      const double lo = stack_.at("translation").at(axes[axis]);
      const double hi = lo + stack_.at("dimension").at(axes[axis]).get<double>();
      first[axis] = static_cast<std::int64_t>(std::floor(lo / static_cast<double>(edge)));
      last[axis] = static_cast<std::int64_t>(std::ceil(hi / static_cast<double>(edge)));
    }
    const double lod = spatial.size() == 1 ? 0 : static_cast<double>(level) / static_cast<double>(spatial.size() - 1);
    Found found;
    for (std::int64_t x = first[0]; x < last[0]; ++x)
      for (std::int64_t y = first[1]; y < last[1]; ++y)
        for (std::int64_t z = first[2]; z < last[2]; ++z) {
          const auto number = [edge](std::int64_t cube) { return std::to_string(cube * edge); };
          const Json answer = ask("/1/node/list?left=" + number(x) + "&top=" + number(y) + "&z1=" + number(z) +
                                  "&right=" + number(x + 1) + "&bottom=" + number(y + 1) + "&z2=" + number(z + 1) +
                                  "&lod_type=percent&lod=" + std::to_string(lod) + "&format=msgpack");
          EXPECT_EQ(answer.at(3), false);
          ++found.cubes;
          found.most = std::max(found.most, answer.at(0).size());
          std::map<std::int64_t, std::int64_t> parents;
          for (const Json& row : answer.at(0)) {
            const auto id = row.at(0).get<std::int64_t>();
            EXPECT_GE(id, 1);
            EXPECT_LE(id, INT32_MAX);
            EXPECT_LE(row.at(7).get<std::int64_t>(), std::int64_t{UINT32_MAX});
            EXPECT_TRUE(parents.emplace(id, row.at(1).is_null() ? 0 : row.at(1).get<std::int64_t>()).second);
            Json& kept = found.nodes[id];
            if (kept.is_null() || kept.at(1).is_null()) kept = row;
          }
          for (const auto& [id, parent] : parents)
            if (parents.contains(parent)) found.links.insert({id, parent});
        }
    return found;
  }

  const test::ServedSets& sets_;
  const std::string base_;
  std::string token_, version_;
  Json stack_, skeletons_;
};

TEST(CatmaidAnswer, EightGetsShowTheWholeSet) {
  const test::ServedSets sets;
  const auto served = sets.shelf->find("column");
  const CatmaidClient client(sets, "column");
  EXPECT_EQ(client.token_, "anonymous");
  EXPECT_TRUE(client.version_.starts_with("2026.")) << client.version_;
  ASSERT_EQ(client.skeletons_.size(), served->set().cell_count());

  const auto& spatial = client.stack_.at("metadata").at("spatial");
  const CatmaidClient::Found found = client.browse(spatial.size() - 1);
  EXPECT_EQ(found.nodes.size(), served->set().counts().samples);
  EXPECT_EQ(found.links.size(), served->set().counts().segments) << "each segment once";
  EXPECT_LE(found.most, spatial.back().at("limit").get<std::size_t>());
  for (std::uint32_t cell = 0; cell < served->set().cell_count(); ++cell) {
    const auto skeleton = client.skeletons_.at(cell).get<std::uint32_t>();
    EXPECT_EQ(skeleton, cell + 1);
    const CellGraph graph = readCell(served->set(), cell, true);
    const std::string path = "/1/skeletons/" + std::to_string(skeleton);
    const Json rows = client.ask(path + "/compact-detail?with_tags=true&with_history=true").at(0);
    ASSERT_EQ(rows.size(), graph.samples());
    const auto first = rows.at(0).at(0).get<std::int64_t>();
    for (std::uint32_t rank = 0; rank < graph.samples(); ++rank) {
      const Json& row = rows.at(rank);
      ASSERT_EQ(row.at(0), first + rank);
      if (graph.parents[rank] == kNoParent) {
        ASSERT_TRUE(row.at(1).is_null());
      } else {
        ASSERT_EQ(row.at(1), first + graph.parents[rank]);
        ASSERT_EQ(found.links.count({first + rank, first + graph.parents[rank]}), 1u);
      }
      const Json& seen = found.nodes.at(first + rank);
      ASSERT_EQ(seen.at(7), skeleton);
      for (std::size_t axis = 0; axis < 3; ++axis) {
        ASSERT_EQ(row.at(3 + axis), graph.position_W(rank)[static_cast<Eigen::Index>(axis)] * 1e3);
        ASSERT_EQ(seen.at(2 + axis), row.at(3 + axis));
      }
      if (!seen.at(1).is_null()) {
        ASSERT_EQ(seen.at(6), row.at(6)) << "radius";
      }
    }
    const Json root = client.ask(path + "/root");
    EXPECT_TRUE(rows.at(static_cast<std::size_t>(root.at("root_id").get<std::int64_t>() - first)).at(1).is_null());
  }
}

TEST(CatmaidAnswer, CoarserLevelsHoldFewerNodesOfTheSameCells) {
  const test::ServedSets sets;
  const CatmaidClient client(sets, "column");
  const auto& spatial = client.stack_.at("metadata").at("spatial");
  ASSERT_GE(spatial.size(), 2u) << "the set has levels";
  std::size_t before = 0;
  for (std::size_t level = 0; level < spatial.size(); ++level) {
    SCOPED_TRACE(level);
    if (level > 0) {
      EXPECT_LT(spatial[level].at("chunk_size").at(0), spatial[level - 1].at("chunk_size").at(0));
    }
    EXPECT_LE(spatial[level].at("chunk_size").at(0).get<std::int64_t>(), std::int64_t{UINT32_MAX});
    const CatmaidClient::Found found = client.browse(level);
    EXPECT_GT(found.nodes.size(), before);
    EXPECT_LE(found.most, spatial[level].at("limit").get<std::size_t>());
    before = found.nodes.size();
    std::set<std::int64_t> cells;
    for (const auto& [id, row] : found.nodes) cells.insert(row.at(7).get<std::int64_t>());
    for (const std::int64_t cell : cells) EXPECT_LE(cell, 10);
  }
}

TEST(CatmaidAnswer, LoopsLoseOneLinkEach) {
  const test::ServedSets sets;
  const CatmaidClient client(sets, "fork");
  const auto found = client.browse(client.stack_.at("metadata").at("spatial").size() - 1);
  EXPECT_EQ(found.nodes.size(), 10u);
  EXPECT_EQ(found.links.size(), 8u) << "4 of the fork, 4 of the square's 5";
}

TEST(CatmaidAnswer, WrongRequestsAreRefused) {
  const test::ServedSets sets;
  const std::string list = "/catmaid/fork/1/node/list";
  EXPECT_EQ(sets.get(list).status, 400u);
  EXPECT_EQ(sets.get(list + "?left=0&top=0&z1=0&right=1&bottom=1").status, 400u);
  EXPECT_EQ(sets.get(list + "?left=0&top=0&z1=0&right=0&bottom=1&z2=1").status, 400u);
  EXPECT_EQ(sets.get(list + "?left=0&top=0&z1=0&right=1&bottom=1&z2=1&lod_type=x").status, 400u);
  EXPECT_EQ(sets.get(list + "?left=0&top=0&z1=0&right=1&bottom=1&z2=1&lod=nan").status, 400u);
  EXPECT_EQ(sets.get(list + "?left=-1e300&top=-1e300&z1=-1e300&right=1e300&bottom=1e300&z2=1e300").status, 200u);
  for (const char* wrong : {"0", "3", "-1", "x", "4294967297"}) {
    const Answer answer = sets.get("/catmaid/fork/1/skeletons/" + std::string(wrong) + "/compact-detail");
    EXPECT_EQ(answer.status, 404u) << wrong;
    EXPECT_NE(answer.body.find("doesn't exist"), std::string::npos) << "clients look for these words";
    EXPECT_EQ(sets.get("/catmaid/fork/1/skeletons/" + std::string(wrong) + "/root").status, 404u) << wrong;
  }
  EXPECT_EQ(sets.get("/catmaid/fork/2/stacks").status, 404u) << "there is one project";
  EXPECT_EQ(sets.ask("POST", list, {}, "x").status, 405u) << "read-only";
}

TEST(CatmaidSpace, SetsWithTooManyNodesAreRefused) {
  EXPECT_NO_THROW(CatmaidSpace::checkNodes(0, INT32_MAX));
  EXPECT_NO_THROW(CatmaidSpace::checkNodes(INT32_MAX, 0));
  EXPECT_THROW(CatmaidSpace::checkNodes(1, INT32_MAX), Refusal);
  EXPECT_THROW(CatmaidSpace::checkNodes(INT32_MAX, 1), Refusal);
  EXPECT_THROW(CatmaidSpace::checkNodes(0, UINT64_MAX), Refusal);
}

}  // namespace
}  // namespace filiform::tools
