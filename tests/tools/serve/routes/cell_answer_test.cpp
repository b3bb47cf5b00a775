// Cells and paths over the routes.
#include "index/contacts/contacts.h"
#include "index/measure/neurite_density.h"
#include "index/query/cell_graph.h"
#include "tests/support/servers/served_sets.h"
#include "tools/words/contact_rows.h"
#include "tools/words/measure_table.h"

#include <algorithm>
#include <bit>
#include <cstring>
#include <numeric>
#include <sstream>
#include <string>
#include <vector>

#include <gtest/gtest.h>

namespace filiform::tools {
namespace {

using Json = nlohmann::json;

TEST(CellAnswer, ListsMatchNames) {
  const test::ServedSets sets;
  const Json all = sets.json("/v1/sets/fork/cells");
  EXPECT_EQ(all.at("truncated"), false);
  EXPECT_EQ(all.at("cursor"), nullptr);
  ASSERT_EQ(all.at("cells").size(), 2u);
  EXPECT_EQ(all["cells"][0].at("name"), "fork");
  EXPECT_EQ(all["cells"][1].at("loops"), 1);
  EXPECT_EQ(sets.json("/v1/sets/fork/cells?name=s*e").at("cells").size(), 1u);
  EXPECT_EQ(sets.json("/v1/sets/fork/cells?name=S*E").at("cells").size(), 1u) << "letter case does not count";
  EXPECT_EQ(sets.json("/v1/sets/fork/cells?name=x*").at("cells").size(), 0u);
  const std::string cells = "/v1/sets/fork/cells?cursor=", revision = sets.shelf->find("fork")->set().revision();
  EXPECT_EQ(sets.json(cells + "start").at("cells").size(), 2u);
  EXPECT_EQ(sets.json(cells + revision + ":1").at("cells").size(), 1u);
  EXPECT_EQ(sets.json(cells + revision + ":99").at("cells").size(), 0u);
  EXPECT_EQ(sets.get(cells + "x").status, 400u);
  EXPECT_EQ(sets.get(cells + "x" + revision + ":1").status, 410u);
}

TEST(CellAnswer, ConditionsOnAttributesChooseTheCells) {
  const test::ServedSets sets;
  const Json found = sets.json("/v1/sets/column/cells?where=layer%3E=4;mtype=*odd");
  ASSERT_EQ(found.at("cells").size(), 3u);
  EXPECT_EQ(found["cells"][0].at("attributes").at("layer"), 5);
  EXPECT_EQ(
      sets.json("/v1/sets/column/cells?where=layer%3C=4&cursor=" + sets.shelf->find("column")->set().revision() + ":3")
          .at("cells")
          .size(),
      2u);
  // measure: of cells; several conditions with one on attributes.
  const Json measured = sets.json("/v1/sets/column/cells?where=measure:length%3E0;layer%3E=4;attribute:mtype=*odd");
  EXPECT_EQ(measured.at("cells"), found.at("cells"));
  EXPECT_TRUE(sets.json("/v1/sets/column/cells?where=measure:length%3C0").at("cells").empty());
  for (const char* const wrong :
       {"where=measure:lenght%3E0", "where=depth=3", "where=", "where=layer", "where=layer%3E=x", "where=;"}) {
    const Answer answer = sets.get(std::string("/v1/sets/column/cells?") + wrong);
    EXPECT_EQ(answer.status, 400u) << wrong;
    EXPECT_NE(answer.body.find("where"), std::string::npos) << answer.body;
  }
}

TEST(CellAnswer, MeasuresAreThoseOfTheTable) {
  const test::ServedSets sets;
  const TileSet& set = sets.shelf->find("column")->set();
  const MeasureTable table(set,
                           {.rows = MeasureRows::kType, .features = parseFeatures("all"), .types = {}, .sholl_um = 20});
  Json expected = Json::array();
  table.measure(
      {1, 2}, 1, [](std::size_t) {},
      [&](const MeasureTable::Row& row) {
        Json json = Json::object();
        for (std::size_t i = 0; i < row.size(); ++i) json[table.columns()[i].title] = measureJson(row[i]);
        expected.push_back(json);
      });
  ASSERT_GT(expected.size(), 1u);
  Json rows = Json::array();
  for (const std::string& name : {set.cell(1).name, set.cell(2).name}) {
    const Json answer = sets.json("/v1/sets/column/measures?per=type&features=all&sholl=20&name=" + name);
    for (const Json& row : answer.at("rows")) rows.push_back(row);
  }
  EXPECT_EQ(rows, expected);
  const std::string second = "cursor=" + set.revision() + ":1&where=layer%3E=4";
  const Json page = sets.json("/v1/sets/column/measures?" + second);
  EXPECT_EQ(page.at("cursor"), nullptr);
  for (const Json& row : page.at("rows")) EXPECT_GT(row.at("length_um").get<double>(), 0);
  EXPECT_EQ(page.at("rows").size(), sets.json("/v1/sets/column/cells?" + second).at("cells").size());
  for (const char* const wrong : {"per=cel", "per=set", "features=lenth", "type=soma", "sholl=0", "sholl=nan",
                                  "sholl=5&per=branch", "where=layer"}) {
    const Answer answer = sets.get(std::string("/v1/sets/column/measures?") + wrong);
    EXPECT_EQ(answer.status, 400u) << wrong << ' ' << answer.body;
    const std::string parameter = std::string(wrong).substr(0, std::string_view(wrong).find('='));
    EXPECT_NE(answer.body.find(parameter), std::string::npos) << answer.body;
  }
}

TEST(CellAnswer, ContactsAreThoseOfTheCell) {
  const test::ServedSets sets;
  const TileSet& set = sets.shelf->find("column")->set();
  std::vector<std::uint32_t> others;
  for (std::uint32_t cell = 0; cell < set.cell_count(); ++cell)
    if (set.cell(cell).name != set.cell(1).name) others.push_back(cell);
  Json expected = Json::array();
  findContacts(set, {.within_um = 20, .from = {1}, .to = others},
               [&](const ContactSite& site) { expected.push_back(Json(contactJson(set, site))); });
  ASSERT_GT(expected.size(), 1u);
  const std::string route = "/v1/sets/column/contacts?cell=" + set.cell(1).name;
  const std::string some = route + "&within=20";
  const Json all = sets.json(some);
  EXPECT_EQ(all.at("rows"), expected);
  EXPECT_EQ(all.at("truncated"), false);
  const Json one = sets.json(some + "&limit=1");
  ASSERT_EQ(one.at("rows").size(), 1u);
  EXPECT_EQ(one.at("rows")[0], expected[0]);
  EXPECT_EQ(one.at("truncated"), true);
  const Json chosen = sets.json(some + "&where=layer%3E=4");
  for (const Json& row : chosen.at("rows")) EXPECT_NE(std::find(expected.begin(), expected.end(), row), expected.end());
  const std::string of_type = expected[0].at("from_type"), to_type = expected[0].at("to_type");
  const Json typed = sets.json(some + "&types=" + of_type + ',' + to_type);
  ASSERT_FALSE(typed.at("rows").empty());
  for (const Json& row : typed.at("rows"))
    EXPECT_TRUE(row.at("from_type") == of_type && row.at("to_type") == to_type) << row;
  for (const char* const wrong : {"within=0", "within=nan", "within=1e9", "types=axno", "surface=yes", "where=layer"}) {
    const Answer answer = sets.get(route + '&' + wrong);
    EXPECT_EQ(answer.status, 400u) << wrong << ' ' << answer.body;
  }
  EXPECT_EQ(sets.get("/v1/sets/column/contacts").status, 400u);
  EXPECT_EQ(sets.get("/v1/sets/column/contacts?cell=missing").status, 404u);
}

TEST(CellAnswer, DensityIsThatOfTheLibrary) {
  const test::ServedSets sets;
  const auto served = sets.shelf->find("column");
  const NeuriteDensity expected = densityOf(served->set(), {.step_um = 50});
  const Json answer = sets.json("/v1/sets/column/density?step=50");
  EXPECT_EQ(answer.at("shape"), Json(expected.boxes));
  EXPECT_EQ(answer.at("origin").at(2), expected.corner_um(0, 0, 0).z());
  double sum_um = 0;
  for (const Json& box : answer.at("boxes")) sum_um += box.at("length").get<double>();
  EXPECT_DOUBLE_EQ(sum_um, std::accumulate(expected.lengths_um.begin(), expected.lengths_um.end(), 0.0));
  EXPECT_LT(sets.json("/v1/sets/column/density?step=50&where=layer%3E=4").at("boxes").size(),
            answer.at("boxes").size());
  for (const char* const wrong : {"", "step=0", "step=x", "step=50&type=axn", "step=1e-3"})
    EXPECT_EQ(sets.get(std::string("/v1/sets/column/density?") + wrong).status, 400u) << wrong;
}

TEST(CellAnswer, ACellIsTheCellOfTheSet) {
  const test::ServedSets sets;
  const auto served = sets.shelf->find("column");
  const CellGraph graph = readCell(served->set(), 3, true);
  std::ostringstream text;
  writeSwc(text, graph);
  const Answer swc = sets.get("/v1/sets/column/cells/" + graph.name + ".swc");
  EXPECT_EQ(swc.status, 200u) << swc.body;
  EXPECT_EQ(swc.body, text.str());
  const Json json = sets.json("/v1/sets/column/cells/" + graph.name + ".json");
  EXPECT_EQ(json.at("name"), graph.name);
  const Json& samples = json.at("samples_by_rank");
  ASSERT_EQ(samples.at("x").size(), graph.samples());
  EXPECT_EQ(samples.at("id"), graph.sample_ids);
  EXPECT_EQ(samples.at("x")[7], graph.position_W(7).x());
  EXPECT_EQ(samples.at("parent")[7], graph.parents[7]);
  const Json loop = sets.json("/v1/sets/fork/cells/square.json");
  EXPECT_EQ(loop.at("links").size(), 5u);
  EXPECT_EQ(sets.get("/v1/sets/fork/cells/square.swc").status, 400u);
  EXPECT_EQ(sets.get("/v1/sets/fork/cells/fork").status, 404u);
  EXPECT_EQ(sets.get("/v1/sets/fork/cells/for.json").status, 404u) << "only whole names";
}

TEST(CellAnswer, ANameWithASlashIsEscaped) {
  const test::ServedSets sets;
  const Answer answer = sets.get("/v1/sets/fork/cells/L5_TPC:A/1234.json");
  EXPECT_EQ(answer.status, 404u);
  EXPECT_NE(answer.body.find("is written %2F"), std::string::npos) << answer.body;
}

TEST(CellAnswer, AnArrayHoldsEachSample) {
  const test::ServedSets sets;
  const CellGraph graph = readCell(sets.shelf->find("column")->set(), 3, true);
  const Answer answer = sets.get("/v1/sets/column/cells/" + graph.name + ".npy");
  ASSERT_EQ(answer.status, 200u) << answer.body;
  EXPECT_EQ(answer.type, kNpyType);
  constexpr std::size_t kRecord = 8 + 3 * 8 + 4 + 2 + 4;
  const std::size_t start = answer.body.find('\n') + 1;
  EXPECT_EQ(start % 64, 0u);
  ASSERT_EQ(answer.body.size(), start + graph.samples() * kRecord);
  for (std::uint32_t rank = 0; rank < graph.samples(); ++rank) {
    const char* at = answer.body.data() + start + rank * kRecord;
    const auto next = [&at](auto value) {
      std::memcpy(&value, at, sizeof value);
      at += sizeof value;
      return value;
    };
    ASSERT_EQ(next(std::int64_t{}), graph.sample_ids[rank]);
    for (int axis = 0; axis < 3; ++axis) ASSERT_EQ(next(0.0), graph.position_W(rank)[axis]);
    ASSERT_EQ(next(std::uint32_t{}), std::bit_cast<std::uint32_t>(graph.radii_um[rank])) << "unknown radii are NaN";
    ASSERT_EQ(next(std::uint16_t{}), graph.types[rank]);
    ASSERT_EQ(next(std::int32_t{}), graph.parents[rank] == kNoParent ? -1 : static_cast<int>(graph.parents[rank]));
  }
  EXPECT_EQ(sets.get("/v1/sets/fork/cells/square.npy").status, 400u);
}

TEST(CellAnswer, PathsAreThoseOfTheCell) {
  const test::ServedSets sets;
  const Json path = sets.json("/v1/sets/fork/path?from=fork:3&to=fork:5");
  EXPECT_EQ(path.at("length_um"), 25);
  EXPECT_EQ(path.at("truncated"), false);
  EXPECT_EQ(path.at("points").size(), 4u);
  EXPECT_EQ(sets.json("/v1/sets/fork/path?from=fork:3%2B0.5&to=fork:4+0.25").at("length_um"), 2.5 + 7.5);
  EXPECT_EQ(sets.json("/v1/sets/fork/path?from=fork:1&to=tip").at("to").at("sample"), 5);
  EXPECT_EQ(sets.get("/v1/sets/fork/path?from=fork:1&to=square:1").status, 400u);
  EXPECT_EQ(sets.get("/v1/sets/fork/path?from=fork:1&to=fork:77").status, 400u);
  EXPECT_EQ(sets.get("/v1/sets/fork/path?from=none:1&to=tip").status, 404u);
  EXPECT_EQ(sets.json("/v1/sets/fork/path?from=FOR:3&to=ork:5").at("length_um"), 25)
      << "a part of a name, as the program";
  EXPECT_EQ(sets.json("/v1/sets/fork/path?from=fork:soma&to=fork:5").at("from").at("sample"), 1);
  EXPECT_EQ(sets.json("/v1/sets/fork/path?from=fork:soma&to=fork:-99,-99,-99").at("truncated"), false);
  EXPECT_EQ(sets.get("/v1/sets/fork/path?from=r:1&to=tip").status, 404u) << "several cells";
  EXPECT_EQ(sets.get("/v1/sets/fork/path?from=fork:1").status, 400u);
}

TEST(Metrics, CountRequestsByRouteAndStatus) {
  test::ServedSets sets;
  sets.metrics.count("/v1/sets", 200, 0.002, 10, 100);
  sets.metrics.count("/v1/sets", 200, 70, 0, 1);
  sets.metrics.count("a\"b\\", 404, 0, 0, 0);
  const std::string text = sets.get("/metrics").body;
  for (const char* line : {"filiform_requests_total{route=\"/v1/sets\",status=\"200\"} 2\n",
                           "filiform_requests_total{route=\"a\\\"b\\\\\",status=\"404\"} 1\n",
                           "filiform_request_seconds_bucket{route=\"/v1/sets\",le=\"0.003\"} 1\n",
                           "filiform_request_seconds_bucket{route=\"/v1/sets\",le=\"5\"} 1\n",
                           "filiform_request_seconds_bucket{route=\"/v1/sets\",le=\"+Inf\"} 2\n",
                           "filiform_request_seconds_sum{route=\"/v1/sets\"} 70.002\n",
                           "filiform_request_seconds_count{route=\"a\\\"b\\\\\"} 1\n",
                           "filiform_sent_bytes_total 101\n", "filiform_tile_bytes{set=\"column\"} ",
                           "filiform_damaged_tiles_total{set=\"fork\"} 0\n", "process_start_time_seconds 1"})
    EXPECT_NE(text.find(line), std::string::npos) << line << text;
  EXPECT_EQ(text.find("filiform_store_requests_total{"), std::string::npos) << "no set is at an address";
}

}  // namespace
}  // namespace filiform::tools
