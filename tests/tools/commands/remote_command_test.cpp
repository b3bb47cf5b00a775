// The commands with a set at an address, as processes: the same answers as with the folder.
#include "tests/support/process.h"
#include "tests/support/sanitized.h"
#include "tests/support/servers/http_server.h"
#include "tests/support/servers/server_process.h"
#include "tests/support/temp_folder.h"
#include "tests/support/variable.h"

#include <chrono>
#include <filesystem>
#include <string>
#include <vector>

#include <gtest/gtest.h>

namespace filiform {
namespace {

namespace fs = std::filesystem;
using test::HttpServer;
using test::Outcome;
using test::runFiliform;

using CommandWords = std::vector<std::string>;

class RemoteCommandTest : public ::testing::Test {
 protected:
  static void SetUpTestSuite() {
    folder_ = std::make_unique<test::TempFolder>();
    ASSERT_EQ(runFiliform({"synth", *folder_ / "a.zip", "--cells", "3", "--seed", "1"}).exit_code, 0);
    ASSERT_EQ(runFiliform({"ingest", *folder_ / "a.zip", "-o", *folder_ / "a.fil"}).exit_code, 0);
    fs::create_directories(*folder_ / "v1/sets/column");
    fs::create_directory_symlink(*folder_ / "a.fil", *folder_ / "v1/sets/column/files");
    const std::string cells = runFiliform({"cells", *folder_ / "a.fil", "--tsv"}).out;
    const std::size_t row = cells.find('\n') + 1, name = cells.find('\t', row) + 1;
    cell_ = cells.substr(name, cells.find('\t', name) - name);
  }
  static void TearDownTestSuite() { folder_.reset(); }

  static std::string replaced(std::string text, const std::string& from, const std::string& to) {
    for (std::size_t at = 0; (at = text.find(from, at)) != std::string::npos; at += to.size())
      text.replace(at, from.size(), to);
    return text;
  }
  // SET stands for the set, OUT for an output file.
  static Outcome runWith(CommandWords words, const std::string& set, const std::string& out) {
    for (std::string& word : words) word = replaced(replaced(word, "SET", set), "OUT", out);
    return runFiliform(words);
  }

  static std::unique_ptr<test::TempFolder> folder_;
  static std::string cell_;
  HttpServer server_{folder_->path()};
};
std::unique_ptr<test::TempFolder> RemoteCommandTest::folder_;
std::string RemoteCommandTest::cell_;

TEST_F(RemoteCommandTest, EachPrintsWhatItPrintsOfTheFolder) {
  std::vector<CommandWords> commands{
      {"info", "SET", "--json"},
      {"info", "SET"},
      {"cells", "SET", "--json"},
      {"nearest", "SET", "0", "700", "0", "--k", "5", "--json"},
      {"nearest", "SET", "0", "700", "0", "--approximate"},
      {"nearest", "SET", "--box", "-50", "600", "-50", "50", "700", "50", "--threads", "4"},
      {"path", "SET", cell_ + ":1", "--to-farthest-tip", "--json"},
      {"navigate", "SET", "--seconds", "0.5", "--budget", "16MiB", "--json", "--csv", "OUT"},
      {"export", "SET", "--cell", cell_, "-o", "OUT"},
      {"verify", "SET"}};
  if (runFiliform({"render", *folder_ / "a.fil", "-o", *folder_ / "try.png", "--size", "16x16"}).exit_code == 0)
    commands.push_back({"render", "SET", "-o", "OUT", "--size", "64x64"});
  const std::string set = *folder_ / "a.fil", here = *folder_ / "here", there = *folder_ / "there";
  for (const CommandWords& words : commands) {
    const Outcome local = runWith(words, set, here);
    ASSERT_EQ(local.exit_code, 0) << local.err;
    for (const std::string& address : {server_ / "a.fil", server_ / "v1/sets/column"}) {
      SCOPED_TRACE(words.front() + " " + address);
      const Outcome remote = runWith(words, address, there);
      EXPECT_EQ(remote.exit_code, 0) << remote.err;
      EXPECT_EQ(test::withoutNetwork(replaced(replaced(remote.out, address, set), there, here)),
                test::withoutNetwork(local.out));
      if (fs::exists(here)) {
        EXPECT_EQ(test::readBytes(there), test::readBytes(here));
        fs::remove(there);
      }
    }
    fs::remove(here);
  }
}

TEST_F(RemoteCommandTest, NavigatesInRealTimeFromFarAway) {
  server_.delay(0.005);
  const Outcome outcome =
      runFiliform({"navigate", server_ / "a.fil", "--realtime", "--seconds", "1", "--budget", "16MiB"});
  EXPECT_EQ(outcome.exit_code, 0) << outcome.err;
}

TEST_F(RemoteCommandTest, TheTokenComesFromAFileOrTheEnvironment) {
  HttpServer asks(folder_->path(), {"--token", "a-secret"});
  const Outcome without = runFiliform({"info", asks / "a.fil"});
  EXPECT_EQ(without.exit_code, 3);
  EXPECT_TRUE(without.oneLineOnStderr()) << without.err;
  EXPECT_NE(without.err.find("--token-file"), std::string::npos) << without.err;
  for (const char* const file : {"a-secret\n",
                                 "\xEF\xBB\xBF"
                                 "a-secret \r\nmade on Monday\n"}) {
    test::writeBytes(*folder_ / "token", file);
    EXPECT_EQ(runFiliform({"info", asks / "a.fil", "--token-file", *folder_ / "token"}).exit_code, 0) << file;
  }
  EXPECT_EQ(test::runFiliformInShell("FILIFORM_TOKEN=a-secret \"$@\"", {"info", asks / "a.fil"}).exit_code, 0);
  const Outcome wrong = test::runFiliformInShell("FILIFORM_TOKEN=other-secret \"$@\"", {"info", asks / "a.fil"});
  EXPECT_EQ(wrong.exit_code, 3);
  EXPECT_EQ(wrong.err.find("other-secret"), std::string::npos) << wrong.err;
  for (const std::string& text : {std::string(), std::string("\n"), std::string(5000, 'x'), std::string("a\tb"),
                                  std::string("a b"), std::string("ä")}) {
    test::writeBytes(*folder_ / "bad", text);
    const Outcome bad = runFiliform({"info", asks / "a.fil", "--token-file", *folder_ / "bad"});
    EXPECT_EQ(bad.exit_code, 2) << bad.err;
    EXPECT_TRUE(bad.oneLineOnStderr()) << bad.err;
  }
  EXPECT_EQ(runFiliform({"info", asks / "a.fil", "--token-file", *folder_ / "none"}).exit_code, 3);
}

TEST_F(RemoteCommandTest, ServeSendsTheTokenOfItsSource) {
  const HttpServer asks(folder_->path(), {"--token", "a-secret"});
  const std::string source = asks / "a.fil", file = *folder_ / "source-token";
  test::writeBytes(file, "\xEF\xBB\xBF a-secret \r\nmade on Monday\n");
  const Outcome without = runFiliform({"serve", source, "--listen", "127.0.0.1:0"});
  EXPECT_EQ(without.exit_code, 3);
  EXPECT_NE(without.err.find("--source-token-file"), std::string::npos) << without.err;
  const auto answers = [&](const std::vector<std::string>& more) {
    std::vector<std::string> words{source, "--no-pictures"};
    words.insert(words.end(), more.begin(), more.end());
    const test::ServerProcess server(words, *folder_ / "log");
    return runFiliform({"info", server.address() + "/v1/sets/a"}).exit_code;
  };
  EXPECT_EQ(answers({"--source-token-file", file}), 0);
  const test::Variable variable("FILIFORM_TOKEN",
                                "\xEF\xBB\xBF"
                                "a-secret\r\n");
  EXPECT_EQ(answers({}), 0);
}

TEST_F(RemoteCommandTest, ACacheIsSharedByCommands) {
  const CommandWords words{"nearest",          server_ / "a.fil", "0",   "700", "0", "--cache",
                           *folder_ / "cache", "--cache-size",    "8MiB"};
  const Outcome first = runFiliform(words);
  ASSERT_EQ(first.exit_code, 0) << first.err;
  const std::size_t asked = server_.log().size();
  EXPECT_EQ(runFiliform(words).out, first.out);
  EXPECT_LT(server_.log().size(), asked);
  EXPECT_EQ(runFiliform({"info", server_ / "a.fil", "--cache", *folder_ / "a.zip"}).exit_code, 3);
}

TEST_F(RemoteCommandTest, AFailureIsOneLineWithTheAddress) {
  std::string closed;
  {
    const HttpServer gone(folder_->path());
    closed = gone / "a.fil";
  }
  for (const std::string& address :
       {closed, server_ / "none.fil", server_.url(), std::string("http://user:s3cret@127.0.0.1/a.fil"),
        std::string("http://127.0.0.1:1/a.fil?token=s3cret")}) {
    for (const char* command : {"info", "verify"}) {
      const Outcome outcome = runFiliform({command, address});
      EXPECT_EQ(outcome.exit_code, address.find("s3cret") != std::string::npos ? 2 : 3) << outcome.err;
      EXPECT_TRUE(outcome.oneLineOnStderr()) << outcome.err;
      EXPECT_EQ(outcome.err.find("s3cret"), std::string::npos) << outcome.err;
    }
  }
}

TEST_F(RemoteCommandTest, NoSetIsWrittenToAnAddress) {
  for (const CommandWords& words : {CommandWords{"ingest", *folder_ / "a.zip", "-o", server_ / "new.fil"},
                                    CommandWords{"ingest", "--add", *folder_ / "a.zip", "-o", server_ / "a.fil"},
                                    CommandWords{"compact", server_ / "a.fil"}}) {
    const Outcome outcome = runFiliform(words);
    EXPECT_EQ(outcome.exit_code, 2);
    EXPECT_NE(outcome.err.find("not to an address"), std::string::npos) << outcome.err;
  }
  EXPECT_FALSE(fs::exists("http:"));
}

TEST_F(RemoteCommandTest, ASignalEndsAWait) {
  server_.fault("silent", "manifest", 1000, {{"s", 60}});
  const auto begin = std::chrono::steady_clock::now();
  const Outcome outcome =
      test::runFiliformInShell("\"$@\" & sleep 1; kill -INT $!; wait $!", {"info", server_ / "a.fil"});
  EXPECT_EQ(outcome.exit_code, 130) << outcome.err;
  EXPECT_LT(std::chrono::steady_clock::now() - begin, std::chrono::seconds(test::kSanitized ? 20 : 8));
}

}  // namespace
}  // namespace filiform
