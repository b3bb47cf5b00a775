#include "device/haply/internal/json_reader.h"

#include <random>
#include <string>

#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

namespace filiform::internal {
namespace {

TEST(JsonReader, ReadsMembersAndSkipsOthers) {
  JsonReader in(R"( {"a":{"deep":[1,{"x":"\"}"}]}, "n":-1.5e2 , "b":true,"s":"t\u00e4" ,"list":[1,2,3],"z":null} )");
  double n = 0, sum = 0;
  bool b = false;
  std::string_view s;
  EXPECT_TRUE(in.object([&](std::string_view key) {
    if (key == "n") in.number(n);
    if (key == "b") in.boolean(b);
    if (key == "s") in.string(s);
    if (key == "list")
      in.array([&] {
        double one = 0;
        in.number(one);
        sum += one;
      });
  }));
  EXPECT_TRUE(in.atEnd());
  EXPECT_EQ(n, -150);
  EXPECT_EQ(sum, 6);
  EXPECT_TRUE(b);
  EXPECT_EQ(s, R"(t\u00e4)");
}

TEST(JsonReader, SkipsValuesOfAnotherType) {
  for (const char* text : {R"({"a":"text"})", R"({"a":[1,2]})", R"({"a":null})", R"({"a":1e999})", R"({"a":true})"}) {
    JsonReader in(text);
    double a = 7;
    EXPECT_TRUE(in.object([&](std::string_view) { EXPECT_FALSE(in.number(a)); })) << text;
    EXPECT_TRUE(in.atEnd()) << text;
    EXPECT_EQ(a, 7) << text;
  }
}

bool isJson(std::string_view text) {
  JsonReader in(text);
  in.skip();
  return in.atEnd();
}

TEST(JsonReader, RefusesWhatIsNotJson) {
  for (const char* text :
       {"",       "{",    "}",  "[1,]", "[,1]", "[1 2]", R"({"a"})", R"({"a":})", R"({"a":1,})", R"({a:1})",
        "01",     "1.",   ".5", "+1",   "nan",  "inf",   "tru",      R"("\x")",   R"("\u12g4")", R"("open)",
        "\"\n\"", "[1]x", "1e", "--1",  "'a'"})
    EXPECT_FALSE(isJson(text)) << text;
  const std::string deepest(JsonReader::kMostDepth, '['), closing(JsonReader::kMostDepth, ']');
  EXPECT_TRUE(isJson(deepest + closing));
  EXPECT_FALSE(isJson("[" + deepest + closing + "]"));
}

// Texts that are nearly JSON, against the library's judgement.
TEST(JsonReader, JudgesAsTheLibrary) {
  const std::string seed = R"({"inverse3":[{"id":"04\"9D","v":{"x":-0.12,"y":1e-3,"z":0},"ok":true}],"n":null})";
  constexpr std::string_view kBytes = "{}[]\",:0123456789.eE+-truefalsn\\ x";
  std::mt19937 random(1);
  int accepted = 0;
  for (int i = 0; i < 20'000; ++i) {
    std::string text = seed;
    for (std::uint32_t change = 0; change < 1 + random() % 2; ++change) {
      const std::size_t at = random() % text.size();
      const char byte = kBytes[random() % kBytes.size()];
      if (random() % 2 == 0)
        text[at] = byte;
      else
        text.erase(at, 1);
    }
    const bool is_json = isJson(text);
    accepted += is_json;
    ASSERT_EQ(is_json, nlohmann::json::accept(text)) << text;
  }
  EXPECT_GT(accepted, 1000);
}

}  // namespace
}  // namespace filiform::internal
