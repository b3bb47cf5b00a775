#include "index/remote/internal/s3_account.h"

#include "index/errors.h"
#include "tests/support/temp_folder.h"

#include <filesystem>
#include <map>
#include <string>

#include <gtest/gtest.h>

namespace filiform {
namespace {

using internal::readS3Account;
using internal::S3Account;
using Variables = std::map<std::string, std::string>;

S3Account accountOf(const Variables& variables) {
  return readS3Account([&](const char* name) -> std::optional<std::string> {
    const auto found = variables.find(name);
    return found != variables.end() ? std::optional(found->second) : std::nullopt;
  });
}

std::string refusalOf(const Variables& variables) {
  try {
    accountOf(variables);
  } catch (const Error& error) {
    return error.what();
  }
  return {};
}

// A home folder with files of AWS.
class S3AccountTest : public ::testing::Test {
 protected:
  S3AccountTest() {
    std::filesystem::create_directory(home_ / ".aws");
    test::writeBytes(home_ / ".aws/credentials",
                     "# keys\n[default]\naws_access_key_id = FIRST\naws_secret_access_key=one/+=\r\n\n"
                     "[lab]\naws_access_key_id=SECOND\naws_secret_access_key=two\naws_session_token = token==\n");
    test::writeBytes(
        home_ / ".aws/config",
        "[default]\nregion = eu-west-1\n[profile lab]\nendpoint_url = https://store.lab:8443/\nregion=lab\n"
        "s3 =\n  addressing_style = path\n  region = not-this\n[profile roles]\nrole_arn = arn:x\n");
  }
  Variables with(Variables more) const {
    more["HOME"] = home_.path();
    return more;
  }
  const test::TempFolder home_;
};

TEST_F(S3AccountTest, WithoutAnythingRequestsAreNotSigned) {
  const S3Account account = accountOf({});
  EXPECT_FALSE(account.hasKeys());
  EXPECT_EQ(account.endpoint, "");
  EXPECT_EQ(account.region, "us-east-1");
}

TEST_F(S3AccountTest, TheDefaultProfileIsRead) {
  const S3Account account = accountOf(with({}));
  EXPECT_EQ(account.access_key, "FIRST");
  EXPECT_EQ(account.secret_key, "one/+=");
  EXPECT_EQ(account.session_token, "");
  EXPECT_EQ(account.region, "eu-west-1");
}

TEST_F(S3AccountTest, ANamedProfileIsReadFromBothFiles) {
  const S3Account account = accountOf(with({{"AWS_PROFILE", "lab"}}));
  EXPECT_EQ(account.access_key, "SECOND");
  EXPECT_EQ(account.session_token, "token==");
  EXPECT_EQ(account.endpoint, "https://store.lab:8443");
  EXPECT_EQ(account.region, "lab");
}

TEST_F(S3AccountTest, VariablesWinOverFilesAndKeysComeFromOnePlace) {
  const S3Account account = accountOf(with({{"AWS_PROFILE", "lab"},
                                            {"AWS_ACCESS_KEY_ID", "A"},
                                            {"AWS_SECRET_ACCESS_KEY", "s"},
                                            {"AWS_REGION", "r-1"},
                                            {"AWS_DEFAULT_REGION", "r-2"},
                                            {"AWS_ENDPOINT_URL", "http://one:1"},
                                            {"AWS_ENDPOINT_URL_S3", "http://two:2"}}));
  EXPECT_EQ(account.access_key, "A");
  EXPECT_EQ(account.session_token, "") << "the token of other keys";
  EXPECT_EQ(account.region, "r-1");
  EXPECT_EQ(account.endpoint, "http://two:2");
  EXPECT_EQ(accountOf(with({{"AWS_ACCESS_KEY_ID", ""}, {"AWS_REGION", ""}})).access_key, "FIRST") << "empty: not set";
}

TEST_F(S3AccountTest, FilesElsewhereAreNamedByVariables) {
  test::writeBytes(home_ / "mine", "[default]\naws_access_key_id=MINE\naws_secret_access_key=s\n");
  EXPECT_EQ(accountOf({{"AWS_SHARED_CREDENTIALS_FILE", home_ / "mine"}}).access_key, "MINE");
}

TEST_F(S3AccountTest, EachMistakeIsOneLineThatNamesTheVariable) {
  const std::vector<std::pair<Variables, std::string>> rows{
      {{{"AWS_ACCESS_KEY_ID", "A"}}, "set both or none"},
      {{{"AWS_PROFILE", "lba"}}, "AWS_PROFILE lba"},
      {{{"AWS_PROFILE", "roles"}}, "role_arn"},
      {{{"AWS_ENDPOINT_URL", "localhost:9000"}}, "AWS_ENDPOINT_URL localhost:9000"},
      {{{"AWS_REGION", "eu west"}}, "AWS_REGION eu west"},
      {{{"AWS_CONFIG_FILE", home_ / "none"}}, "cannot be opened"},
      {{{"AWS_ACCESS_KEY_ID", "A\nB"}, {"AWS_SECRET_ACCESS_KEY", "s3cret"}}, "AWS_ACCESS_KEY_ID contains"},
  };
  for (const auto& [variables, said] : rows) {
    const std::string line = refusalOf(with(variables));
    EXPECT_NE(line.find(said), std::string::npos) << said << ": " << line;
    EXPECT_EQ(line.find('\n'), std::string::npos) << line;
    EXPECT_EQ(line.find("s3cret"), std::string::npos) << "a secret in a message";
  }
}

}  // namespace
}  // namespace filiform
