#include "index/remote/internal/s3_answer.h"

#include <string>
#include <vector>

#include <gtest/gtest.h>

namespace filiform {
namespace {

using internal::HttpLanding;
using internal::judgeS3;
using internal::S3Account;

TEST(S3Answer, EveryRefusalSaysWhatToDo) {
  const S3Account keys{.access_key = "A", .secret_key = "s"}, anonymous;
  struct Row {
    long status;
    std::string code, region;
    const S3Account& account;
    std::string said;
  };
  const std::vector<Row> rows{
      {403, "RequestTimeTooSkewed", "", keys, "clock is 60 minutes behind"},
      {400, "ExpiredToken", "", keys, "AWS_SESSION_TOKEN"},
      {400, "InvalidToken", "", keys, "AWS_SESSION_TOKEN"},
      {403, "InvalidAccessKeyId", "", keys, "AWS_ACCESS_KEY_ID"},
      {403, "SignatureDoesNotMatch", "", keys, "AWS_SECRET_ACCESS_KEY"},
      {404, "NoSuchBucket", "", keys, "the bucket's name"},
      {301, "PermanentRedirect", "eu-west-1", anonymous, "set AWS_REGION=eu-west-1"},
      {400, "AuthorizationHeaderMalformed", "", keys, "set AWS_REGION"},
      {403, "AccessDenied", "", anonymous, "set AWS_ACCESS_KEY_ID"},
      {403, "", "", keys, "what the keys allow"},
  };
  for (const Row& row : rows) {
    const HttpLanding landing = judgeS3({.status = row.status,
                                         .body = "<Error><Code>" + row.code + "</Code></Error>",
                                         .region = row.region,
                                         .clock_ahead_s = -3600},
                                        row.account, {.kind = HttpLanding::Kind::retry});
    const bool denied = row.code.empty() || row.code == "AccessDenied";
    EXPECT_EQ(landing.kind, denied ? HttpLanding::Kind::denied : HttpLanding::Kind::refused) << row.code;
    const std::string line = landing.what + "; " + landing.remedy;
    EXPECT_NE(line.find(row.said), std::string::npos) << line;
    EXPECT_NE(line.find("(" + std::to_string(row.status)), std::string::npos) << line;
    EXPECT_EQ(line.find(" )"), std::string::npos) << line;
  }
}

TEST(S3Answer, ABusyStoreIsAskedAgain) {
  const HttpLanding landing =
      judgeS3({.status = 503, .body = "<?xml?><Error><Code>SlowDown</Code></Error>"}, {},
              {.kind = HttpLanding::Kind::retry, .what = "the server answered 503", .remedy = "try again later"});
  EXPECT_EQ(landing.kind, HttpLanding::Kind::retry);
  EXPECT_EQ(landing.what, "the store asks for fewer requests (503 SlowDown)");
  EXPECT_EQ(landing.remedy, "try again later");
}

TEST(S3Answer, HostileXmlIsHarmless) {
  EXPECT_EQ(internal::xmlText("<Code>", "Code"), "");
  EXPECT_EQ(internal::xmlText("", "Code"), "");
  EXPECT_EQ(internal::xmlText("<Code></Code>", "Code"), "");
  const HttpLanding landing =
      judgeS3({.status = 500, .body = "<Code>\x1b[31m" + std::string(5000, 'x') + "</Code>"}, {}, {.what = "answered"});
  EXPECT_EQ(landing.what.find('\x1b'), std::string::npos);
  EXPECT_LT(landing.what.size(), 200u);
}

}  // namespace
}  // namespace filiform
