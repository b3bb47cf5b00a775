// The table of routes: what it answers and refuses, and that the description of the interface follows from it.
#include "tools/serve/routes/routes.h"

#include "tests/support/servers/served_sets.h"

#include <algorithm>
#include <fstream>
#include <random>
#include <set>
#include <string>

#include <gtest/gtest.h>

namespace filiform::tools {
namespace {

using Json = nlohmann::json;

// A request that each route answers with 200.
std::string exampleOf(const std::string& path, const std::string& revision) {
  std::string target = path;
  const auto replace = [&](const std::string& from, const std::string& to) {
    if (const std::size_t at = target.find(from); at != std::string::npos) target.replace(at, from.size(), to);
  };
  replace("{set}", "fork");
  replace("{revision}", revision);
  replace("{file}", "manifest.json");
  replace("{range}", "0-9");
  replace("{cell}", "fork.json");
  replace("{skeleton}", "1");
  replace("{desk}", "bench");
  if (path.ends_with("/nearest")) target += "?at=1,2,3";
  if (path.ends_with("/box")) target += "?lo=0,0,0&hi=1,1,1";
  if (path.ends_with("/ray")) target += "?from=0,0,0&direction=0,0,1";
  if (path.ends_with("/node/list")) target += "?left=0&top=0&z1=0&right=9&bottom=9&z2=9";
  if (path.ends_with("/contacts")) target += "?cell=fork&within=0.1";
  if (path.ends_with("/density")) target += "?step=10";
  if (path.ends_with("/path")) target += "?from=fork:1&to=fork:3";
  return target;
}

TEST(Routes, TheDescriptionFitsEveryRoute) {
  test::ServedSets sets;
  sets.service->web_folder = sets.folder.path();
  const Json description = sets.json("/v1/openapi.json");
  EXPECT_EQ(description.at("openapi"), "3.1.0");
  const std::string revision = sets.shelf->find("fork")->set().revision();
  std::set<std::string> ids;
  std::size_t operations = 0;
  for (const auto& [path, item] : description.at("paths").items())
    for (const auto& [method, operation] : item.items()) {
      ++operations;
      SCOPED_TRACE(method + " " + path);
      EXPECT_TRUE(ids.insert(operation.at("operationId")).second);
      if (path.starts_with("/travel/page/")) std::ofstream(sets.folder / path.substr(path.rfind('/') + 1)) << "page";
      const bool post = method == "post";
      EXPECT_EQ(post, operation.contains("requestBody"));
      const std::string target = post ? "/v1/sets/fork/nearest" : exampleOf(path, revision);
      const Answer answer = post ? sets.ask("POST", target, {{"content-type", kJsonType}}, R"({"points":[[1,2,3]]})")
                                 : sets.ask(method == "delete" ? "DELETE" : "GET", target, {});
      // These sets have neither pictures, nor sockets, nor a token; tests/groups/service/openapi_check.py calls the
      // same on a server.
      const bool is_socket = operation.at("responses").contains("101");
      EXPECT_EQ(is_socket, path.ends_with("/session") || path.find("/desks/") != std::string::npos);
      const bool needs_server = path.ends_with("/picture") || is_socket || method == "delete";
      EXPECT_EQ(answer.status == 200u, !needs_server) << answer.status << answer.body;
      if (needs_server) continue;
      std::set<std::string> types;
      for (const auto& [type, schema] : operation.at("responses").at("200").at("content").items()) types.insert(type);
      const std::string type = answer.type.substr(0, answer.type.find(';'));
      EXPECT_TRUE(types.contains(type) || type == kJsonType) << type;
      // Every parameter named is known, and no other.
      for (const auto& parameter : operation.at("parameters")) {
        const std::string name = parameter.at("name");
        if (parameter.at("in") == "path") {
          EXPECT_NE(path.find("{" + name + "}"), std::string::npos);
          continue;
        }
        const std::string separator = target.find('?') == std::string::npos ? "?" : "&";
        const std::string body = sets.ask(post ? "POST" : "GET", target + separator + name + "=1", {}).body;
        EXPECT_EQ(body.find("unknown parameter"), std::string::npos) << body;
      }
      const std::string separator = target.find('?') == std::string::npos ? "?" : "&";
      EXPECT_EQ(sets.get(exampleOf(path, revision) + separator + "nonsense=1").status, 400u);
    }
  EXPECT_EQ(operations, allRoutes().size());
}

TEST(Routes, FailuresAreProblems) {
  const test::ServedSets sets;
  const auto expectProblem = [](const Answer& answer, unsigned status) {
    EXPECT_EQ(answer.status, status) << answer.body;
    EXPECT_EQ(answer.type, "application/problem+json");
    const Json json = Json::parse(answer.body);
    EXPECT_EQ(json.at("status"), status);
    EXPECT_EQ(json.at("title"), reasonPhrase(status));
    EXPECT_FALSE(json.at("detail").get<std::string>().empty());
  };
  expectProblem(sets.get("/v2"), 404);
  expectProblem(sets.get("/v1/sets/"), 404);
  expectProblem(sets.get("/v1/sets/absent"), 404);
  expectProblem(sets.get("/v1/sets/..%2Ffork"), 404);
  expectProblem(sets.get("/v1/sets/fork/nearest"), 400);
  expectProblem(sets.get("/v1/sets/fork/nearest?at=1,2"), 400);
  expectProblem(sets.get("/v1/sets/fork/nearest?at=1,2,3&k=0"), 400);
  expectProblem(sets.get("/v1/sets/fork/nearest?at=1,2,3&k=99999999"), 400);
  expectProblem(sets.get("/v1/sets/fork/nearest?at=1,2,3&epsilon=-1"), 400);
  expectProblem(sets.get("/v1/sets/fork/box?lo=5,5,5&hi=0,0,0"), 400);
  expectProblem(sets.get("/v1/sets/fork/ray?from=0,0,0&direction=0,0,0"), 400);
  expectProblem(sets.ask("POST", "/v1/sets/fork/nearest", {}, "x"), 415);
  expectProblem(sets.ask("POST", "/v1/sets/fork/nearest", {{"content-encoding", "gzip"}}, "x"), 415);
  expectProblem(sets.ask("POST", "/v1/sets", {}), 405);
  expectProblem(sets.ask("DELETE", "/v1/sets/fork", {}), 405);
  EXPECT_EQ(sets.ask("DELETE", "/v1/sets/fork/nearest", {}).header("Allow"), "GET, HEAD, POST");
  expectProblem(sets.get("/" + std::string(9000, 'a')), 400);
  EXPECT_TRUE(sets.log.empty());
}

TEST(Routes, TextOfRequestsAndFilesIsEscaped) {
  const test::ServedSets sets;
  const Answer answer = sets.get("/v1/sets/%3Cscript%3E%1b%22");
  EXPECT_EQ(answer.status, 404u);
  EXPECT_EQ(answer.body.find('\x1b'), std::string::npos);
  EXPECT_NO_THROW(Json::parse(answer.body));
  const Answer page = sets.get("/", {{"host", "localhost"}});
  EXPECT_EQ(page.status, 200u);
  EXPECT_NE(page.body.find("column"), std::string::npos);
  EXPECT_NE(page.header("Content-Security-Policy").find("frame-ancestors 'none'"), std::string::npos);
}

// Text made from pieces of right requests. Every answer has a status that the service documents.
TEST(Routes, AnyTargetGetsADocumentedStatus) {
  const test::ServedSets sets;
  const std::vector<std::string> pieces{"/",       "v1",    "sets",  "fork", "column", "files", "CURRENT",  "cells",
                                        "nearest", "..",    "?",     "=",    "&",      "%",     "%00",      "%2F",
                                        "at",      "1,2,3", "1e308", "k",    "-1",     "lo",    "hi",       "0,0",
                                        "nan",     "path",  "from",  "to",   "fork:1", "tip",   "box",      "ray",
                                        "token",   "~",     "*",     "[",    "cursor", "name",  "fork.swc", "\x7f"};
  std::mt19937_64 random(23);
  std::set<unsigned> seen;
  for (int i = 0; i < 20000; ++i) {
    std::string target = random() % 8 == 0 ? "" : random() % 2 == 0 ? "/v1/sets/fork/" : "/";
    for (std::size_t n = random() % 12; n > 0; --n) target += pieces[random() % pieces.size()];
    seen.insert(
        sets.ask(random() % 4 == 0 ? "POST" : "GET", target, {{"content-type", "application/x-npy"}}, "x").status);
  }
  for (const unsigned status : seen)
    EXPECT_TRUE(std::string(reasonPhrase(status)) != "Error" && status != 500) << status;
  EXPECT_TRUE(sets.log.empty()) << sets.log.front();
}

}  // namespace
}  // namespace filiform::tools
