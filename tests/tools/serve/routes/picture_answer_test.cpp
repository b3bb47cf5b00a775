// Pictures over the routes: what is drawn, kept and refused.
#include "tests/support/sanitized.h"
#include "tests/support/servers/served_sets.h"
#include "tools/serve/sets/picture_maker.h"
#include "tools/words/refusal.h"

#include <chrono>
#include <future>
#include <memory>
#include <string>
#include <thread>
#include <vector>

#include <gtest/gtest.h>

namespace filiform::tools {
namespace {

class PictureAnswer : public ::testing::Test {
 protected:
  void SetUp() override {
    if (test::kSanitized) GTEST_SKIP() << "the OpenGL driver leaks";
    sets_.service->pictures = &maker_;
    if (sets_.get("/v1/sets/fork/picture?size=8x8").status == 501) GTEST_SKIP() << "needs OpenGL 3.3";
  }
  test::ServedSets sets_;
  PictureMaker maker_;
};

TEST_F(PictureAnswer, IsAPngOfTheAskedSize) {
  const Answer answer = sets_.get("/v1/sets/column/picture?camera=30,20&size=120x80");
  ASSERT_EQ(answer.status, 200u) << answer.body;
  EXPECT_EQ(answer.type, "image/png");
  ASSERT_GT(answer.body.size(), 200u) << "not one colour";
  EXPECT_EQ(answer.body.substr(0, 8), "\x89PNG\r\n\x1a\n");
  EXPECT_EQ(answer.body.substr(16, 8), std::string("\0\0\0\x78\0\0\0\x50", 8));
  EXPECT_EQ(sets_.get("/v1/sets/column/picture?camera=30,20&size=120x80").body, answer.body);
  EXPECT_NE(sets_.get("/v1/sets/column/picture?camera=top&size=120x80").body, answer.body);
  EXPECT_EQ(sets_.get("/v1/sets/column/picture?camera=0,0,900:0,0,0&size=120x80").status, 200u);
}

TEST_F(PictureAnswer, WrongRequestsAreRefused) {
  for (const char* wrong : {"camera=x", "camera=follow", "camera=1,2,3", "camera=0,0,0:0,0,0", "camera=nan,0", "size=1",
                            "size=0x5", "size=2049x1", "size=1e3x1.5", "size=99999999999x1"})
    EXPECT_EQ(sets_.get(std::string("/v1/sets/fork/picture?") + wrong).status, 400u) << wrong;
  EXPECT_EQ(sets_.get("/v1/sets/none/picture").status, 404u);
}

TEST_F(PictureAnswer, FewAreDrawnAtATime) {
  std::vector<std::future<unsigned>> asked;
  for (int i = 0; i < 24; ++i)
    asked.push_back(std::async(std::launch::async, [this, i] {
      return sets_.get("/v1/sets/column/picture?size=900x700&camera=" + std::to_string(i) + ",0").status;
    }));
  int drawn = 0, refused = 0;
  for (auto& status : asked) {
    const unsigned got = status.get();
    EXPECT_TRUE(got == 200 || got == 503) << got;
    ++(got == 200 ? drawn : refused);
  }
  EXPECT_GE(drawn, 1);
  EXPECT_GE(refused, 1) << "24 at once, " << PictureMaker::kMostPictures << " allowed";
}

TEST_F(PictureAnswer, IsDrawnAlthoughNobodyWaits) {
  const auto served = sets_.service->shelf.find("column");
  const auto draw = [&]() -> std::shared_ptr<const std::string> {
    try {
      return maker_.draw(served, "50,10", {100, 80}, 0);
    } catch (const AnswerTimeout&) {
      return nullptr;
    }
  };
  const auto until = std::chrono::steady_clock::now() + std::chrono::seconds(60);
  auto picture = draw();
  while (picture == nullptr && std::chrono::steady_clock::now() < until) {
    std::this_thread::sleep_for(std::chrono::milliseconds(10));
    picture = draw();
  }
  EXPECT_NE(picture, nullptr);
}

TEST(PictureMaker, IsAbsentWithoutPictures) {
  const test::ServedSets sets;
  EXPECT_EQ(sets.get("/v1/sets/fork/picture").status, 501u);
}

}  // namespace
}  // namespace filiform::tools
