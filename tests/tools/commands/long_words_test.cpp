// Words of 60 000 characters wherever a user or a file gives words: a documented exit code, and short lines that repeat
// at most 200 characters.
#include "tests/support/run_here.h"
#include "tests/support/sanitized.h"
#include "tests/support/servers/served_column.h"
#include "tests/support/temp_folder.h"
#include "tests/support/variable.h"
#include "tests/support/zip_builder.h"

#include <filesystem>
#include <sstream>
#include <string>
#include <vector>

#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

namespace filiform {
namespace {

namespace fs = std::filesystem;
using Json = nlohmann::json;
using test::Outcome;

constexpr std::size_t kLong = 60'000;

// Of one letter, of many short words, and of digits.
std::vector<std::string> longWords() {
  std::string words, numbers;
  while (words.size() < kLong) words += "x ";
  while (numbers.size() < kLong) numbers += "7,";
  return {std::string(kLong, 'x'), words, std::string(kLong, '7'), numbers};
}

class LongWords : public ::testing::Test {
 protected:
  LongWords() { fs::current_path(folder_.path()); }
  ~LongWords() override { fs::current_path(before_); }

  static void expectShort(const Outcome& outcome) {
    EXPECT_TRUE(outcome.exit_code >= 0 && outcome.exit_code <= 3) << outcome.exit_code;
    EXPECT_EQ(outcome.err.find("internal error"), std::string::npos) << outcome.err.substr(0, 1000);
    std::istringstream lines(outcome.err);
    for (std::string line; std::getline(lines, line);) EXPECT_LT(line.size(), 1000u) << line.substr(0, 300);
  }
  static void removeOutputs() {
    for (const char* made : {"new.fil", "new.zip", "out.swc"}) fs::remove_all(made);
  }

  fs::path before_ = fs::current_path();
  test::TempFolder folder_;
};

Json usage() { return Json::parse(test::runHere({"--json-usage"}).out); }

const Json& commandNamed(const Json& usage, const std::string& name) {
  for (const Json& command : usage.at("commands"))
    if (command.at("name") == name) return command;
  throw std::runtime_error("no command " + name);
}

TEST_F(LongWords, InEveryOptionAndArgumentOfEveryCommandAreRefusedInShort) {
  test::makeInputs();
  const Json all = usage();
  const std::vector<std::string> words = test::kSanitized ? std::vector{longWords().front()} : longWords();
  for (const std::vector<std::string>& good : test::goodCommands()) {
    for (const std::string& word : words) {
      for (std::size_t i = 0; i < good.size(); ++i) {
        SCOPED_TRACE(good[0] + ", word " + std::to_string(i));
        std::vector<std::string> line = good;
        line[i] = word;
        expectShort(test::runHere(line));
        removeOutputs();
      }
      for (const Json& option : commandNamed(all, good[0]).at("options")) {
        const std::string name = option.at("names").back();
        SCOPED_TRACE(good[0] + " " + name);
        std::vector<std::string> line = good;
        if (option.at("values") == 0) {
          line.push_back(name + "=" + word);
        } else {
          line.push_back(name);
          for (int i = 0; i < option.at("values").get<int>(); ++i) line.push_back(word);
        }
        expectShort(test::runHere(line));
        removeOutputs();
      }
      expectShort(test::runHere({good[0], "--" + word}));
      expectShort(test::runHere({good[0], word, word, word, word, word}));
    }
    ASSERT_FALSE(HasNonfatalFailure());
  }
}

// `serve`, `view` and `render` as processes: the first two may run until they are ended, and render uses the driver.
TEST_F(LongWords, InOptionsOfServersAndWindowsAreRefusedInShort) {
  if (test::kSanitized) GTEST_SKIP() << "the OpenGL driver leaks, and the sanitizer changes the exit code";
  test::makeInputs();
  const Json all = usage();
  const std::string word = longWords().front();
  for (const std::vector<std::string>& good : {std::vector<std::string>{"serve", "set.fil", "--listen", "127.0.0.1:0"},
                                               {"view", "set.fil"},
                                               {"render", "set.fil", "-o", "out.png", "--size", "16x16"}}) {
    for (const Json& option : commandNamed(all, good[0]).at("options")) {
      if (option.at("values") != 1) continue;
      const std::string name = option.at("names").back();
      SCOPED_TRACE(good[0] + " " + name);
      std::vector<std::string> line = good;
      line.insert(line.end(), {name, word});
      Outcome outcome = test::runFiliformInShell("unset DISPLAY WAYLAND_DISPLAY; timeout 1 \"$@\"", line);
      if (outcome.exit_code == 124 || outcome.exit_code == 143) outcome.exit_code = 0;  // a name that it accepts
      expectShort(outcome);
    }
  }
}

TEST_F(LongWords, InVariablesAreRefusedInShort) {
  test::makeInputs();
  const std::string word = longWords().front();
  const Json all = usage();
  std::size_t tried = 0;
  for (const std::vector<std::string>& good : test::goodCommands())
    for (const Json& option : commandNamed(all, good[0]).at("options")) {
      if (option.at("environment").is_null()) continue;
      const std::string name = option.at("environment");
      const test::Variable variable(name.c_str(), word);
      SCOPED_TRACE(good[0] + " with " + name);
      expectShort(test::runHere(good));
      removeOutputs();
      ++tried;
    }
  EXPECT_GT(tried, 5u);
  const std::vector<std::pair<const char*, std::vector<std::string>>> others{
      {"FILIFORM_TOKEN", {"info", "http://127.0.0.1:1/v1/sets/x"}},
      {"FILIFORM_WEB", {"view", "set.fil", "--web"}},
      {"FILIFORM_BRIDGE_COOKIE", {"devices", "--test", "bridge"}},
      {"FILIFORM_FALCON_FIRMWARE", {"devices", "--test", "falcon"}},
      {"FILIFORM_HAPLY_SERVICE", {"devices", "--test", "haply"}},
      {"FILIFORM_HDF5", {"check", "x.h5"}},
      {"FILIFORM_HDF5_SECONDS", {"check", "x.h5"}},
      {"AWS_PROFILE", {"push", "set.fil", "s3://bucket/name.fil"}},
      {"AWS_ENDPOINT_URL", {"push", "set.fil", "s3://bucket/name.fil"}},
      {"HOME", {"info", "set.fil"}},
      {"TMPDIR", {"ingest", "cell.swc", "-o", "new.fil"}}};
  test::writeBytes("x.h5", "no");
  for (const auto& [name, line] : others) {
    const test::Variable variable(name, word);
    SCOPED_TRACE(name);
    expectShort(test::runFiliform(line));
    removeOutputs();
  }
}

TEST_F(LongWords, InFilesAreRefusedInShort) {
  test::makeInputs();
  for (const std::string& word : longWords()) {
    for (const std::string& text : {word, word + " 1 2", "1 2 " + word, "1 " + word + " 2 3"}) {
      test::writeBytes("points.txt", text);
      expectShort(test::runHere({"nearest", "set.fil", "--points", "points.txt"}));
      test::writeBytes("ids.txt", text);
      expectShort(test::runHere({"ingest", "cell.swc", "--ids", "ids.txt", "-o", "new.fil"}));
      test::writeBytes("placements.tsv", text);
      expectShort(test::runHere({"ingest", "cell.swc", "--placements", "placements.tsv", "-o", "new.fil"}));
      removeOutputs();
    }
    for (const std::string& text :
         {word, "[" + word + "]\n", "[ingest]\n" + word + " = 1\n", "[ingest]\ncapacity = \"" + word + "\"\n",
          "[ingest]\ncapacity = " + word + "\n", "[ingest]\nmemory = \"" + word + "\"\n", word + " = 1\n"}) {
      test::writeBytes("f.toml", text);
      expectShort(test::runHere({"--config", "f.toml", "ingest", "cell.swc", "-o", "new.fil"}));
      removeOutputs();
    }
    for (const std::string& text : {"name," + word + "\ncell,1\n", word + ",a\ncell,1\n", "name,a\n" + word + ",1\n",
                                    "name,a\ncell," + word + "\n", "name,a\ncell,1," + word + "\n"}) {
      test::writeBytes("t.csv", text);
      expectShort(test::runHere({"ingest", "cell.swc", "--attributes", "t.csv", "--key", "name", "-o", "new.fil"}));
      expectShort(test::runHere({"cells", "new.fil", "--where", "b=1"}));
      removeOutputs();
    }
  }
}

TEST_F(LongWords, InTheNameOfACellAreRepeatedInShort) {
  const std::string name(kLong, 'x'), other(kLong, 'y');
  const std::string cell = "1 1 0 0 0 5 -1\n2 3 10 0 0 1 1\n4 3 20 0 0 1 9\n";
  test::writeBytes("long.zip",
                   test::buildZip({test::zipMember(name + ".swc", cell), test::zipMember(other + ".swc", cell),
                                   test::zipMember(name + "z.swc", "no cell")}));
  const Outcome made = test::runFiliform({"ingest", "long.zip", "-o", "long.fil"});
  EXPECT_EQ(made.exit_code, 0) << made.err.substr(0, 1000);
  const std::vector<std::vector<std::string>> lines{{"check", "long.zip"},
                                                    {"check", "long.zip", "--strict"},
                                                    {"ingest", "long.zip", "--strict", "-o", "new.fil"},
                                                    {"ingest", "--add", "long.zip", "-o", "long.fil"},
                                                    {"ingest", "--remove", name + "x", "-o", "long.fil"},
                                                    {"info", "long.fil"},
                                                    {"info", "long.fil", "--parameters", "--cell", "xz"},
                                                    {"cells", "long.fil", "--name", "x"},
                                                    {"path", "long.fil", name + ":77", name + ":1"},
                                                    {"path", "long.fil", name + ":1", other + ":1"},
                                                    {"path", "long.fil", name + ":1", name + ":4"},
                                                    {"path", "long.fil", "x:1", "zz:4"},
                                                    {"nearest", "long.fil", "0", "0", "0"},
                                                    {"navigate", "long.fil", "--cell", name, "--route", "1:77"},
                                                    {"navigate", "long.fil", "--cell", "swc", "--seconds", "0.01"},
                                                    {"export", "long.fil", "--all", "-o", "folder"},
                                                    {"export", "long.fil", "--cell", "x" + name, "-o", "x.swc"}};
  for (const std::vector<std::string>& line : lines) {
    SCOPED_TRACE(line[0] + " " + line[1].substr(0, 100));
    expectShort(test::runFiliform(line));
  }
  std::istringstream said(test::runFiliform({"ingest", "long.zip", "-o", "again.fil"}).out);
  for (std::string text; std::getline(said, text);) EXPECT_LT(text.size(), 1000u) << text.substr(0, 300);
}

class LongRequests : public test::ServedColumn {};

TEST_F(LongRequests, GetShortAnswers) {
  test::ServerProcess& server = start({"--threads", "1"});
  const std::uint16_t port = server.port();
  const std::string word(kLong, 'x');
  const auto expectShort = [](const test::RawClient::Reply& reply) {
    const bool is_answer = reply.status >= 200 && reply.status < 500;  // 503: pictures take turns
    EXPECT_TRUE(reply.status == 0 || is_answer || reply.status == 503) << reply.status;
    if (reply.status >= 400) {
      EXPECT_LT(reply.body.size(), 1000u) << reply.body.substr(0, 300);
    }
  };
  for (const char* header : {"Origin", "Host", "Authorization", "Cookie", "Accept", "If-None-Match", "Range",
                             "Content-Type", "Content-Encoding", "Sec-WebSocket-Protocol", "Upgrade", "X-Other"})
    for (const std::size_t length : {std::size_t{15'000}, kLong}) {
      SCOPED_TRACE(header);
      expectShort(test::fetch(port, "/v1/sets/t/nearest?at=1,2,3", {{header, word.substr(0, length)}}));
      expectShort(test::fetch(port, "/v1/sets/t/nearest", {{header, word.substr(0, length)}}, "{}"));
    }
  const Json openapi = Json::parse(test::fetch(port, "/v1/openapi.json").body);
  std::size_t tried = 0;
  for (const auto& [path, methods] : openapi.at("paths").items()) {
    std::string target = path;
    if (const std::size_t set = target.find("{set}"); set != std::string::npos) target.replace(set, 5, "t");
    for (const std::size_t length : {std::size_t{7'000}, kLong}) {
      const std::string given = word.substr(0, length);
      std::string filled = target;
      for (std::size_t open; (open = filled.find('{')) != std::string::npos;)
        filled.replace(open, filled.find('}') - open + 1, given);
      SCOPED_TRACE(path);
      expectShort(test::fetch(port, filled));
      expectShort(test::fetch(port, target + "?" + given + "=1"));
      expectShort(test::fetch(port, target + "?" + given));
      if (!methods.contains("get")) continue;
      for (const Json& parameter : methods["get"].value("parameters", Json::array())) {
        if (parameter.at("in") != "query") continue;
        expectShort(test::fetch(port, target + "?" + parameter.at("name").get<std::string>() + "=" + given));
        ++tried;
      }
    }
  }
  EXPECT_GT(tried, 40u);
  for (const char* place : {"from", "to"})
    expectShort(test::fetch(port, std::string("/v1/sets/t/path?from=cell:1&to=cell:2&") + place + "=" + word));
  EXPECT_EQ(test::fetch(port, "/healthz").status, 200u) << "the server lives";
}

}  // namespace
}  // namespace filiform
