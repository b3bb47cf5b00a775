// What is read from a request's target, and what is refused.
#include "tools/serve/routes/request.h"

#include "tools/words/refusal.h"

#include <string>

#include <gtest/gtest.h>

namespace filiform::tools {
namespace {

Request parsed(const std::string& target) {
  Request request;
  request.target = target;
  request.parseTarget();
  return request;
}

unsigned statusOfTarget(const std::string& target) {
  try {
    parsed(target);
    return 200;
  } catch (const Refusal& refusal) {
    return refusal.status();
  }
}

TEST(Request, PartsAndParametersAreDecoded) {
  const Request request = parsed("/v1/sets/a%2Fb%20c/path?from=x%3A1&to=CELL:12+0.25");
  EXPECT_EQ(request.parts, (std::vector<std::string>{"v1", "sets", "a/b c", "path"}));
  EXPECT_EQ(request.parameter("from"), "x:1");
  EXPECT_EQ(request.parameter("to"), "CELL:12+0.25") << "a plus stands for itself";
  EXPECT_EQ(parsed("/").parts, std::vector<std::string>{""});
  EXPECT_EQ(parsed("/a/../b").parts, (std::vector<std::string>{"a", "..", "b"})) << "no part has a meaning";
}

TEST(Request, WrongTargetsAreRefused) {
  for (const std::string target :
       {"", "v1", "*", "http://x/", "/%", "/%4", "/%zz", "/a b", "/a?x", "/a?x=1&x=2", "/a#b", "/\x80", "/a?=%g1"})
    EXPECT_EQ(statusOfTarget(target), 400u) << target;
  EXPECT_EQ(statusOfTarget(std::string("/a\0b", 4)), 400u);
}

TEST(Request, NumbersMustBeWholeAndFinite) {
  const Request request = parsed("/?a=1.5&b=nan&c=1x&d=7&e=-1&f=&g=1e999");
  EXPECT_EQ(request.number("a"), 1.5);
  EXPECT_EQ(request.number("absent"), std::nullopt);
  for (const char* name : {"b", "c", "f", "g"}) EXPECT_THROW(request.number(name), Refusal) << name;
  EXPECT_EQ(request.whole("d", 1, 7), 7u);
  EXPECT_THROW(request.whole("d", 1, 6), Refusal);
  for (const char* name : {"a", "e", "f"}) EXPECT_THROW(request.whole(name, 0, 100), Refusal) << name;
  EXPECT_EQ(parseNumbers("at", "1,-2.5,3e2", 3), (std::vector<double>{1, -2.5, 300}));
  for (const char* text : {"1,2", "1,2,3,4", "1,2,", "1, 2,3", "inf,1,1", ""})
    EXPECT_THROW(parseNumbers("at", text, 3), Refusal) << text;
}

TEST(Request, LogsShowNoToken) {
  EXPECT_EQ(redacted("/?token=secret&x=1"), "/?token=...&x=1");
  EXPECT_EQ(redacted("/?to%6ben=secret"), "/?token=...");
  EXPECT_EQ(redacted("/?%zz=secret"), "/?token=...");
  EXPECT_EQ(redacted("/v1/sets?a=b"), "/v1/sets?a=b");
  EXPECT_EQ(redacted("/precomputed/~secret/fork/info"), "/precomputed/~.../fork/info");
  EXPECT_EQ(redacted("/catmaid/%7esecret/fork/version?token=x"), "/catmaid/~.../fork/version?token=...");
  EXPECT_EQ(redacted(""), "");
}

}  // namespace
}  // namespace filiform::tools
