// filiform tidy as a process. tests/index/stores/set_tidy_test.cpp has its rules.
#include "tests/support/process.h"
#include "tests/support/servers/http_server.h"
#include "tests/support/temp_folder.h"
#include "tests/support/variable.h"

#include <chrono>
#include <filesystem>
#include <string>

#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

namespace filiform {
namespace {

namespace fs = std::filesystem;
using test::Outcome;
using test::runFiliform;
using test::Variable;

TEST(TidyCommand, ListsThenRemoves) {
  const test::TempFolder folder;
  const std::string root = folder / "store", place = "s3://bucket/lab/a.fil";
  fs::create_directories(root + "/bucket");
  const test::HttpServer server(root, {"--store", "secret"});
  const Variable endpoint("AWS_ENDPOINT_URL", server.url()), key("AWS_ACCESS_KEY_ID", "KEY"),
      secret("AWS_SECRET_ACCESS_KEY", "secret"), home("HOME", folder.path());
  const Outcome nothing = runFiliform({"tidy", place});
  EXPECT_EQ(nothing.exit_code, 1);
  EXPECT_NE(nothing.err.find("has no CURRENT"), std::string::npos) << nothing.err;
  for (const char* const seed : {"1", "2"}) {
    ASSERT_EQ(runFiliform({"synth", folder / "a.zip", "--cells", "2", "--seed", seed}).exit_code, 0);
    ASSERT_EQ(runFiliform({"ingest", folder / "a.zip", "--force", "-o", folder / "a.fil"}).exit_code, 0);
    const Outcome pushed = runFiliform({"push", folder / "a.fil", place});
    ASSERT_EQ(pushed.exit_code, 0) << pushed.err;
    if (std::string(seed) == "1")
      for (const auto& entry : fs::recursive_directory_iterator(root))
        if (entry.is_regular_file())
          fs::last_write_time(entry.path(), fs::file_time_type::clock::now() - std::chrono::hours(24 * 8));
  }
  const Outcome young = runFiliform({"tidy", place, "--older-than", "9", "--yes"});
  EXPECT_NE(young.out.find("nothing to remove: no revision is out of use and older than 9 days\n"), std::string::npos)
      << young.out;
  const Outcome listed = runFiliform({"tidy", place});
  EXPECT_EQ(listed.exit_code, 0) << listed.err;
  EXPECT_NE(listed.out.find("8 days\told\n"), std::string::npos) << listed.out;
  EXPECT_NE(listed.out.find("0 days\tcurrent\n"), std::string::npos) << listed.out;
  EXPECT_NE(listed.out.find(": to remove: 1 revision, "), std::string::npos) << listed.out;
  EXPECT_NE(listed.out.find("; add --yes to remove\n"), std::string::npos) << listed.out;
  const Outcome removed = runFiliform({"tidy", place, "--yes", "--json"});
  EXPECT_EQ(removed.exit_code, 0) << removed.err;
  const auto json = nlohmann::json::parse(removed.out);
  EXPECT_EQ(json.at("revisions").size(), 2u);
  EXPECT_GT(json.at("removed_objects"), 3);
  EXPECT_EQ(runFiliform({"verify", place}).exit_code, 0);
  EXPECT_EQ(nlohmann::json::parse(runFiliform({"tidy", place, "--json"}).out).at("revisions").size(), 1u);
  for (const std::string& wrong : {folder / "a.fil", server / "bucket/lab/a.fil"}) {
    const Outcome refused = runFiliform({"tidy", wrong});
    EXPECT_EQ(refused.exit_code, 2);
    EXPECT_TRUE(refused.oneLineOnStderr()) << refused.err;
    EXPECT_NE(refused.err.find("s3://BUCKET/PATH/NAME.fil"), std::string::npos) << refused.err;
  }
}

}  // namespace
}  // namespace filiform
