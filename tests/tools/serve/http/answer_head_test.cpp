// The head of an answer, to the byte.
#include "tools/serve/http/answer_head.h"

#include <gtest/gtest.h>

namespace filiform::tools {
namespace {

TEST(AnswerHead, HoldsStatusLengthAndHeaders) {
  Answer answer{.type = "text/plain", .body = "ok\n"};
  answer.headers = {{"ETag", "\"x\""}};
  const std::string end =
      "X-Content-Type-Options: nosniff\r\nReferrer-Policy: no-referrer\r\nCross-Origin-Resource-Policy: "
      "same-origin\r\n";
  EXPECT_EQ(
      answerHead(answer, true, 1767225600),
      "HTTP/1.1 200 OK\r\nDate: Thu, 01 Jan 2026 00:00:00 GMT\r\nContent-Type: text/plain\r\nContent-Length: 3\r\n"
      "ETag: \"x\"\r\n" +
          end + "\r\n");
  answer.file = FileRange{nullptr, "f", 5, 7};
  EXPECT_NE(answerHead(answer, false, 0).find("Content-Length: 7\r\n"), std::string::npos);
  EXPECT_TRUE(answerHead(answer, false, 0).ends_with(end + "Connection: close\r\n\r\n"));
  const std::string unchanged = answerHead({.status = 304}, true, 0);
  EXPECT_EQ(unchanged.find("Content-Length"), std::string::npos);
  EXPECT_EQ(unchanged.find("Content-Type:"), std::string::npos);
}

}  // namespace
}  // namespace filiform::tools
