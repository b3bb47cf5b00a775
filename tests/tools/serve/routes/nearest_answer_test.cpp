// nearest, box and ray over the routes give what the library gives, in JSON and in .npy.
#include "index/measure/cell_measures.h"
#include "tests/support/servers/served_sets.h"
#include "tools/serve/sets/limits.h"

#include <algorithm>
#include <atomic>
#include <cmath>
#include <functional>
#include <random>
#include <set>
#include <string>
#include <utility>
#include <vector>
#include <zlib.h>

#include <gtest/gtest.h>

namespace filiform::tools {
namespace {

using Json = nlohmann::json;
using test::NpyRow;

class NearestAnswer : public ::testing::Test {
 protected:
  std::vector<Vector3d> points(std::size_t count) const {
    std::mt19937_64 random(41);
    std::uniform_real_distribution<double> along(-200, 500);
    std::vector<Vector3d> list;
    for (std::size_t i = 0; i < count; ++i) list.emplace_back(along(random), along(random), along(random));
    return list;
  }
  const ServedSet& column() const { return *(column_ = sets_.shelf->find("column")); }
  void expectRow(const NpyRow& row, std::size_t query, const NearestResult& r) const {
    EXPECT_EQ(row.query, query);
    EXPECT_EQ(row.rank, r.rank);
    EXPECT_EQ(row.distance, r.distance_um);
    EXPECT_EQ(Vector3d(row.x, row.y, row.z), r.p_W);
    EXPECT_EQ(row.cell, r.segment.cell);
    EXPECT_EQ(row.segment, r.segment.segment);
    EXPECT_EQ(row.sample, column().set().loadCellDetail(r.segment.cell).sample_ids[r.segment.segment]);
    EXPECT_EQ(row.exact, r.exact);
    const SegmentLook look = column().looks().of(std::vector{r})[0];
    EXPECT_EQ(row.type, *look.type);
    EXPECT_TRUE(row.radius == look.radius_um || (std::isnan(row.radius) && std::isnan(look.radius_um)));
    EXPECT_EQ(row.t, r.t);
  }
  test::ServedSets sets_;
  mutable std::shared_ptr<const ServedSet> column_;
};

TEST_F(NearestAnswer, ArraysHoldWhatTheLibraryFinds) {
  const std::vector<Vector3d> asked = points(500);
  const Answer answer = sets_.ask("POST", "/v1/sets/column/nearest?k=3",
                                  {{"content-type", kNpyType}, {"accept", kNpyType}}, test::npyOf(asked));
  ASSERT_EQ(answer.status, 200u) << answer.body;
  EXPECT_EQ(answer.type, kNpyType);
  EXPECT_EQ(answer.header("Filiform-Truncated"), "false");
  const std::vector<NpyRow> rows = test::npyRows(answer.body);
  ASSERT_EQ(rows.size(), 1500u);
  for (std::size_t i = 0; i < asked.size(); ++i) {
    const auto found = column().nearest().find(asked[i], {.k = 3});
    for (std::size_t r = 0; r < 3; ++r) expectRow(rows[3 * i + r], i, found[r]);
  }
}

TEST_F(NearestAnswer, JsonHoldsTheSameNumbers) {
  const std::vector<Vector3d> asked = points(50);
  Json body{{"points", Json::array()}, {"k", 2}, {"epsilon", 0}};
  for (const Vector3d& p : asked) body["points"].push_back({p.x(), p.y(), p.z()});
  const Answer json = sets_.ask("POST", "/v1/sets/column/nearest", {{"content-type", "application/json"}}, body.dump());
  ASSERT_EQ(json.status, 200u) << json.body;
  const Answer npy = sets_.ask("POST", "/v1/sets/column/nearest?k=2",
                               {{"content-type", kNpyType}, {"accept", kNpyType}}, test::npyOf(asked));
  const std::vector<NpyRow> rows = test::npyRows(npy.body);
  const Json parsed = Json::parse(json.body);
  EXPECT_EQ(parsed.at("truncated"), false);
  ASSERT_EQ(parsed.at("rows").size(), rows.size());
  for (std::size_t i = 0; i < rows.size(); ++i) {
    const Json& row = parsed["rows"][i];
    EXPECT_EQ(row.at("distance"), rows[i].distance);
    EXPECT_EQ(row.at("x"), rows[i].x);
    EXPECT_EQ(row.at("cell"), column().set().cell(rows[i].cell).name);
    EXPECT_EQ(row.at("segment"), rows[i].segment);
    EXPECT_EQ(row.at("sample"), rows[i].sample);
    EXPECT_EQ(row.at("query"), rows[i].query);
    EXPECT_EQ(neuriteType(row.at("type").get<std::string>()), rows[i].type);
    EXPECT_EQ(row.at("radius"), std::isnan(rows[i].radius) ? Json() : Json(rows[i].radius));
    EXPECT_EQ(row.at("t"), rows[i].t);
  }
  const Json one = sets_.json("/v1/sets/fork/nearest?at=10,-15,1");
  ASSERT_EQ(one.at("rows").size(), 1u);
  EXPECT_EQ(one["rows"][0].at("sample"), 5);
  EXPECT_EQ(one["rows"][0].at("distance"), 1);
  const Json loop = sets_.json("/v1/sets/fork/nearest?at=2,0,7");
  EXPECT_EQ(loop["rows"][0].at("cell"), "square");
}

TEST_F(NearestAnswer, ARadiusFindsAllWithin) {
  const Json all = sets_.json("/v1/sets/fork/nearest?at=10,0,0&radius=11");
  EXPECT_EQ(all.at("truncated"), false);
  std::set<std::int64_t> samples;
  for (const Json& row : all.at("rows"))
    if (row.at("cell") == "fork") samples.insert(row.at("sample").get<std::int64_t>());
  EXPECT_EQ(samples, (std::set<std::int64_t>{2, 3, 4, 5}));
  EXPECT_EQ(sets_.json("/v1/sets/fork/nearest?at=10,0,0&radius=0.5&k=9").at("rows").size(), 3u);
  EXPECT_EQ(sets_.json("/v1/sets/fork/nearest?at=1000,0,0&radius=1").at("rows").size(), 0u);
}

// The rows of all parts of an answer, and the number of parts.
std::pair<std::vector<Json>, std::size_t> allParts(const std::function<Json(const std::string& cursor)>& ask) {
  std::pair<std::vector<Json>, std::size_t> all;
  for (Json cursor = "start"; !cursor.is_null(); ++all.second) {
    const Json part = ask(cursor.get<std::string>());
    cursor = part.at("cursor");
    EXPECT_EQ(part.at("truncated"), !cursor.is_null());
    for (const Json& row : part.at("rows")) all.first.push_back(row);
  }
  return all;
}

TEST_F(NearestAnswer, ThePartsOfABoxHoldEachOfItsSegmentsOnce) {
  const std::string box = "/v1/sets/column/box?lo=-100,-100,-100&hi=300,300,300";
  std::set<std::pair<std::string, int>> whole, parts;
  const Json answer = sets_.json(box);
  for (const Json& row : answer.at("rows")) whole.emplace(row.at("cell"), row.at("segment"));
  const auto [rows, count] =
      allParts([&](const std::string& cursor) { return sets_.json(box + "&limit=7&cursor=" + cursor); });
  for (const Json& row : rows) EXPECT_TRUE(parts.emplace(row.at("cell"), row.at("segment")).second) << row;
  EXPECT_EQ(parts, whole);
  EXPECT_EQ(count, (whole.size() + 6) / 7);
  const Answer npy = sets_.get(box + "&limit=7&cursor=start", {{"accept", "application/x-npy"}});
  EXPECT_EQ(test::npyRows(npy.body).size(), 7U);
  EXPECT_FALSE(npy.header("Filiform-Cursor").empty());
}

TEST_F(NearestAnswer, ThePartsOfABatchAreTheBatch) {
  const std::string body = test::npyOf(points(1500));
  const std::map<std::string, std::string> headers{{"content-type", kNpyType}, {"accept", kNpyType}};
  const auto rowsOf = [&](const std::string& cursor, std::string* next) {
    const Answer answer = sets_.ask("POST", "/v1/sets/column/nearest?k=100" + cursor, headers, body);
    EXPECT_EQ(answer.status, 200U) << answer.body;
    if (next != nullptr) *next = answer.header("Filiform-Cursor");
    return test::npyRows(answer.body);
  };
  const std::vector<NpyRow> whole = rowsOf("", nullptr);
  ASSERT_EQ(whole.size(), 150000U);
  std::vector<NpyRow> parts;
  std::size_t count = 0;
  for (std::string cursor = "start"; !cursor.empty(); ++count)
    for (const NpyRow& row : rowsOf("&cursor=" + std::string(cursor), &cursor)) parts.push_back(row);
  EXPECT_GE(count, 2U);
  ASSERT_EQ(parts.size(), whole.size());
  for (std::size_t i = 0; i < whole.size(); ++i) {
    ASSERT_EQ(parts[i].query, whole[i].query);
    ASSERT_EQ(parts[i].segment, whole[i].segment);
  }
}

TEST_F(NearestAnswer, ACursorIsOfOneRevisionAndNothingElse) {
  const std::string box = "/v1/sets/column/box?lo=-100,-100,-100&hi=300,300,300&limit=3&cursor=";
  const std::string cursor = sets_.json(box + "start").at("cursor");
  EXPECT_EQ(sets_.get(box + "x" + cursor).status, 410U);
  for (const std::string& wrong :
       {std::string(), std::string("1"), cursor + ":1", cursor + "x", cursor.substr(0, cursor.rfind(':'))})
    EXPECT_EQ(sets_.get(box + wrong).status, 400U) << wrong;
  EXPECT_EQ(sets_.get(box + "start&cells=true").status, 400U);
  const std::string far = cursor.substr(0, cursor.find(':')) + ":4294967295:18446744073709551615";
  EXPECT_EQ(sets_.json(box + far).at("rows").size(), 0U);
}

TEST_F(NearestAnswer, BoxesAndRaysAreThoseOfTheLibrary) {
  const auto found = column().nearest().inBox({-100, -100, -100}, {300, 300, 300});
  ASSERT_GT(found.size(), 20u);
  const Answer box =
      sets_.get("/v1/sets/column/box?lo=-100,-100,-100&hi=300,300,300", {{"accept", "application/x-npy"}});
  const std::vector<NpyRow> rows = test::npyRows(box.body);
  ASSERT_EQ(rows.size(), found.size());
  for (std::size_t i = 0; i < rows.size(); ++i) expectRow(rows[i], 0, found[i]);
  const Json few = sets_.json("/v1/sets/column/box?lo=-100,-100,-100&hi=300,300,300&limit=7");
  EXPECT_EQ(few.at("truncated"), true);
  EXPECT_EQ(few.at("rows").size(), 7u);
  const auto hits =
      column().nearest().alongRay({.origin_W = {-200, 50, 50}, .direction = {1, 0.1, 0}, .radius_um = 20, .most = 5});
  ASSERT_EQ(hits.size(), 5u);
  const Json ray = sets_.json("/v1/sets/column/ray?from=-200,50,50&direction=1,0.1,0&tolerance=20&k=5");
  EXPECT_EQ(ray.at("truncated"), true);
  ASSERT_EQ(ray.at("rows").size(), 5u);
  for (std::size_t i = 0; i < 5; ++i) {
    EXPECT_EQ(ray["rows"][i].at("along"), hits[i].along_um);
    EXPECT_EQ(ray["rows"][i].at("segment"), hits[i].segment.segment);
  }
}

TEST_F(NearestAnswer, LimitsAreEnforced) {
  const auto post = [&](const std::string& query, std::size_t count) {
    return sets_.ask("POST", "/v1/sets/column/nearest" + query, {{"content-type", kNpyType}, {"accept", kNpyType}},
                     test::npyOf(std::vector<Vector3d>(count, Vector3d(0, 0, 0))));
  };
  EXPECT_EQ(post("", limits::kPoints + 1).status, 413u);
  EXPECT_EQ(post("?k=1001", 1000).status, 413u);
  EXPECT_EQ(post("?k=10001", 1).status, 400u);
  EXPECT_EQ(post("?k=1", 0).status, 200u);
  EXPECT_EQ(post("?at=1,2,3", 1).status, 400u) << "at and a body";
  EXPECT_EQ(
      sets_.ask("POST", "/v1/sets/column/nearest?k=1", {{"content-type", kJsonType}}, R"({"points":[],"k":1})").status,
      400u)
      << "k twice";
  EXPECT_EQ(
      sets_.ask("POST", "/v1/sets/column/nearest", {{"content-type", kJsonType}}, R"({"points":[],"j":1})").status,
      400u);
}

TEST_F(NearestAnswer, SampleIdsAreKeptWithinTheirBudget) {
  SampleIds ids(column().set(), 3000);
  for (int round = 0; round < 2; ++round)
    for (std::uint32_t cell = 0; cell < column().set().cell_count(); ++cell) {
      const IdRuns expected = childSampleIds(column().set(), cell);
      const auto kept = ids.cell(cell);
      for (std::uint32_t s = 0; s < expected.size(); ++s) ASSERT_EQ(kept->of(s), expected[s]);
      EXPECT_LE(ids.bytes(), 3000u);
    }
  EXPECT_GT(ids.bytes(), 0u);
}

TEST_F(NearestAnswer, CachesAskWhetherTheAnswerIsTheSame) {
  const std::string target = "/v1/sets/column/nearest?at=1,2,3";
  const Answer first = sets_.get(target);
  const std::string tag = first.header("ETag");
  EXPECT_TRUE(tag.starts_with("W/\"" + column().set().revision() + '-')) << tag;
  EXPECT_EQ(first.header("Cache-Control"), "public, no-cache");
  EXPECT_EQ(sets_.get(target, {{"if-none-match", "*"}}).status, 304u);
  const Answer same = sets_.get(target, {{"if-none-match", "\"x\", " + tag}});
  EXPECT_EQ(same.status, 304u);
  EXPECT_EQ(same.body, "");
  EXPECT_EQ(same.header("ETag"), tag);
  EXPECT_NE(sets_.get(target + "&k=2").header("ETag"), tag);
  EXPECT_NE(sets_.get("/v1/sets/fork/nearest?at=1,2,3").header("ETag"), tag);
  EXPECT_NE(sets_.get(target, {{"accept", kNpyType}}).header("ETag"), tag);
  EXPECT_EQ(sets_.get("/v1/sets/column/nearest?at=1,2").header("ETag"), "") << "an error has none";
  EXPECT_EQ(sets_.get("/v1/sets").header("Cache-Control"), "no-store");
}

TEST_F(NearestAnswer, TextIsCompressedForClientsThatTakeIt) {
  const std::string target = "/v1/sets/column/nearest?at=1,2,3&k=100";
  const Answer plain = sets_.get(target), packed = sets_.get(target, {{"accept-encoding", "br, gzip"}});
  EXPECT_EQ(plain.header("Content-Encoding"), "");
  EXPECT_EQ(packed.header("Content-Encoding"), "gzip");
  EXPECT_NE(packed.header("Vary").find("Accept-Encoding"), std::string::npos);
  EXPECT_LT(packed.body.size(), plain.body.size() / 2);
  std::string text(plain.body.size() + 100, '\0');
  z_stream stream{};
  ASSERT_EQ(::inflateInit2(&stream, 31), Z_OK);
  std::string bytes = packed.body;
  stream.next_in = reinterpret_cast<Bytef*>(bytes.data());
  stream.avail_in = static_cast<uInt>(bytes.size());
  stream.next_out = reinterpret_cast<Bytef*>(text.data());
  stream.avail_out = static_cast<uInt>(text.size());
  EXPECT_EQ(::inflate(&stream, Z_FINISH), Z_STREAM_END);
  text.resize(stream.total_out);
  ::inflateEnd(&stream);
  EXPECT_EQ(text, plain.body);
  EXPECT_EQ(sets_.get(target, {{"accept-encoding", "gzip;q=0, br"}}).header("Content-Encoding"), "");
  const Answer small = sets_.get("/v1/sets/column/nearest?at=1,2,3", {{"accept-encoding", "gzip"}});
  EXPECT_EQ(small.header("Content-Encoding"), "") << "too small to gain";
  EXPECT_EQ(sets_.get(target, {{"accept-encoding", "gzip"}, {"accept", kNpyType}}).header("Content-Encoding"), "");
}

TEST_F(NearestAnswer, WorkEndsWhenNobodyWaits) {
  std::atomic<bool> left{true};
  for (const char* target : {"/nearest?at=1,2,3", "/box?lo=0,0,0&hi=50,500,50", "/density?step=10"}) {
    Request request;
    request.method = "GET";
    request.target = std::string("/v1/sets/column") + target;
    request.headers["host"] = "localhost";
    EXPECT_EQ(sets_.routes->answer(request, &left).answer.status, 503u) << target;
  }
  EXPECT_EQ(sets_.get("/v1/sets/column/nearest?at=1,2,3").status, 200u);
}

TEST_F(NearestAnswer, ReadsEndWhenTheTimeIsOver) {
  const TimedStore::Limit limit(0);
  EXPECT_THROW(column().store().load(0), AnswerTimeout);
  EXPECT_THROW(column().nearest().find({1, 2, 3}), AnswerTimeout);
  EXPECT_THROW(TimedStore::check(), AnswerTimeout);
}

TEST_F(NearestAnswer, ParametersFilterTheSegments) {
  const std::string name = column().set().cell(1).name, at = "/v1/sets/column/nearest?at=10,20,30&k=5";
  const std::vector<NearestResult> of_cell =
      Nearest(column().set(), {.filter = {.cells = std::vector{1u}}}).find(Vector3d(10, 20, 30), {.k = 5});
  for (int i = 0; i < 2; ++i) {  // made, then kept
    const Json rows = Json::parse(sets_.get(at + "&cell=" + name).body).at("rows");
    ASSERT_EQ(rows.size(), of_cell.size());
    for (std::size_t r = 0; r < rows.size(); ++r) EXPECT_EQ(rows[r].at("segment"), of_cell[r].segment.segment);
  }
  std::set<std::string> cells;
  const Json others = Json::parse(sets_.get(at + "&cells=true&not_cell=" + name).body).at("rows");
  for (const Json& row : others) cells.insert(row.at("cell"));
  EXPECT_EQ(cells.size(), 5u);
  EXPECT_FALSE(cells.contains(name));
  const std::vector<NearestResult> of_others =
      column().nearest().find(Vector3d(10, 20, 30), {.k = 5, .other_cells = true});
  const Json other = Json::parse(sets_.get(at + "&own=no").body).at("rows");
  ASSERT_EQ(other.size(), of_others.size());
  for (std::size_t r = 0; r < other.size(); ++r) EXPECT_EQ(other[r].at("segment"), of_others[r].segment.segment);
  EXPECT_EQ(Json::parse(sets_.get(at + "&type=77").body).at("rows").size(), 0u);
  EXPECT_EQ(sets_.get(at + "&cell=unknown").status, 404u);
  for (const char* wrong : {"&type=axn", "&cells=yes", "&own=false", "&where=depth%3D1"})
    EXPECT_EQ(sets_.get(at + wrong).status, 400u) << wrong;
}

}  // namespace
}  // namespace filiform::tools
