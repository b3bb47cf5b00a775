#include "index/internal/descriptor.h"

#include <array>
#include <fcntl.h>
#include <string>
#include <vector>

#include <gtest/gtest.h>

namespace filiform::internal {
namespace {

TEST(Descriptor, CallsAreRepeatedAfterASignalUntilAllIsDone) {
  std::vector<std::size_t> asked;
  const auto call = [&](std::size_t done) -> ssize_t {
    asked.push_back(done);
    errno = EINTR;
    return asked.size() % 2 == 1 ? -1 : 3;
  };
  EXPECT_EQ(repeatCall(6, EIO, call), 6u);
  EXPECT_EQ(asked, (std::vector<std::size_t>{0, 0, 3, 3}));
}

TEST(Descriptor, ACallThatFailsOrDoesNothingEndsTheRepetition) {
  const auto failing = [](std::size_t) -> ssize_t {
    errno = EDQUOT;
    return -1;
  };
  EXPECT_EQ(repeatCall(6, ENOSPC, failing), std::nullopt);
  EXPECT_EQ(errno, EDQUOT);
  EXPECT_EQ(repeatCall(6, ENOSPC, [](std::size_t done) -> ssize_t { return done == 0 ? 4 : 0; }), 4u);
  EXPECT_EQ(errno, ENOSPC);
}

TEST(Descriptor, ReadsAPipeToItsEndAndClosesItsFile) {
  int ends[2];
  ASSERT_EQ(::pipe2(ends, O_CLOEXEC), 0);
  Descriptor from(ends[0]), to(ends[1]);
  EXPECT_TRUE(to.write("abc", 3));
  EXPECT_TRUE(to.write("de", 2));
  to = {};
  EXPECT_EQ(::fcntl(ends[1], F_GETFD), -1);
  std::array<char, 8> bytes{};
  EXPECT_EQ(from.read(bytes.data(), bytes.size()), 5u);
  EXPECT_EQ(errno, EIO);
  EXPECT_EQ(std::string(bytes.data(), 5), "abcde");
  { const Descriptor last(std::move(from)); }
  EXPECT_FALSE(from.isOpen());
  EXPECT_EQ(::fcntl(ends[0], F_GETFD), -1);
}

}  // namespace
}  // namespace filiform::internal
