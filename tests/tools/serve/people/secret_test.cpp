// Texts that open a server, and the files that hold them.
#include "tools/serve/people/secret.h"

#include "index/errors.h"
#include "tests/support/temp_folder.h"
#include "tools/serve/people/secret_file.h"

#include <filesystem>
#include <string>
#include <vector>

#include <gtest/gtest.h>

namespace filiform::tools {
namespace {

const std::string kFitToken = "0123456789abcdef0123";

TEST(Secret, TokensAreReadFromTheFirstLine) {
  const test::TempFolder folder;
  const auto read = [&](const std::string& bytes) {
    test::writeBytes(folder / "token", bytes);
    return readToken("--token-file", folder / "token");
  };
  EXPECT_EQ(read(kFitToken), kFitToken);
  EXPECT_EQ(read("\xEF\xBB\xBF" + kFitToken + " \r\nmore\n"), kFitToken);
  for (const std::string wrong : {"", "short", "\n0123456789abcdef0123", "0123456789abcdef 0123",
                                  "0123456789abcdef\t0123", "0123456789abcdef;0123"})
    EXPECT_THROW(read(wrong), UsageError) << wrong;
  EXPECT_THROW(readToken("--token-file", folder / "absent"), IoError);
}

TEST(Secret, RandomTextsDiffer) {
  EXPECT_EQ(randomText().size(), 32u);
  EXPECT_NE(randomText(), randomText());
  EXPECT_TRUE(isFitToken(randomText()));
  EXPECT_FALSE(isSecret("", ""));
  EXPECT_TRUE(isSecret("abc", "abc"));
  EXPECT_FALSE(isSecret("abcabc", "abc"));
}

TEST(SecretFile, SaysWhenItChangesAndWhoMayReadIt) {
  const test::TempFolder folder;
  const std::string path = folder / "token";
  SecretFile file("--token-file", path);
  std::vector<std::string> told;
  const auto tell = [&told](const std::string& line) { told.push_back(line); };
  EXPECT_FALSE(file.hasChanged(tell)) << "there is none";
  namespace fs = std::filesystem;
  test::writeBytes(path, "one");
  fs::permissions(path, fs::perms::owner_read | fs::perms::owner_write);
  EXPECT_FALSE(file.hasChanged(tell)) << "the first look";
  fs::rename(path, folder / "old");
  EXPECT_FALSE(file.hasChanged(tell)) << "while an editor writes it anew";
  test::writeBytes(path, "two");
  fs::permissions(path, fs::perms::owner_read | fs::perms::owner_write | fs::perms::others_read);
  EXPECT_TRUE(file.hasChanged(tell));
  EXPECT_FALSE(file.hasChanged(tell));
  ASSERT_EQ(told.size(), 1u);
  EXPECT_NE(told[0].find("--token-file"), std::string::npos) << told[0];
  EXPECT_NE(told[0].find("chmod 600"), std::string::npos) << told[0];
  EXPECT_FALSE(SecretFile("--tokens", "").hasChanged(tell));
}

}  // namespace
}  // namespace filiform::tools
