// info --sha256 and verify --sha256.
#include "tests/support/process.h"
#include "tests/support/temp_folder.h"

#include <cctype>
#include <string>

#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

namespace filiform {
namespace {

using test::Outcome;
using test::runFiliform;

TEST(DigestCommand, TheDigestNamesASet) {
  const test::TempFolder folder;
  test::writeBytes(folder.file("cell.swc"), "1 1 0 0 0 5 -1\n2 3 10 0 0 1 1\n");
  ASSERT_EQ(runFiliform({"ingest", folder.file("cell.swc"), "-o", folder.file("a.fil")}).exit_code, 0);
  const Outcome info = runFiliform({"info", folder.file("a.fil"), "--sha256", "--json"});
  ASSERT_EQ(info.exit_code, 0) << info.err;
  const std::string digest = nlohmann::json::parse(info.out).at("sha256");
  EXPECT_NE(runFiliform({"info", folder.file("a.fil"), "--sha256"}).out.find(digest), std::string::npos);
  std::string upper = digest;
  for (char& c : upper) c = static_cast<char>(std::toupper(c));
  EXPECT_EQ(runFiliform({"verify", folder.file("a.fil"), "--sha256", upper}).exit_code, 0);
  const Outcome other = runFiliform({"verify", folder.file("a.fil"), "--sha256", std::string(64, '1')});
  EXPECT_EQ(other.exit_code, 1);
  EXPECT_TRUE(other.oneLineOnStderr()) << other.err;
  EXPECT_NE(other.err.find(digest), std::string::npos) << other.err;
  for (const char* const mistake : {"12", "", "r-0123456789abcdef"}) {
    const Outcome outcome = runFiliform({"verify", folder.file("a.fil"), "--sha256", mistake});
    EXPECT_EQ(outcome.exit_code, 2) << mistake;
    EXPECT_TRUE(outcome.oneLineOnStderr()) << outcome.err;
  }
}

}  // namespace
}  // namespace filiform
