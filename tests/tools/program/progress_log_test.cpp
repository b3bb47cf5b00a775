#include "tools/program/progress_log.h"

#include <chrono>
#include <mutex>
#include <string>
#include <thread>

#include <gtest/gtest.h>

namespace filiform::tools {
namespace {

class ProgressLogLines : public testing::Test {
 protected:
  std::function<void(const std::string&)> sink() {
    return [this](const std::string& line) {
      const std::lock_guard lock(mutex_);
      text_ += line;
    };
  }
  std::string text() {
    const std::lock_guard lock(mutex_);
    return text_;
  }
  void waitFor(const std::string& part) {
    while (text().find(part) == std::string::npos) std::this_thread::sleep_for(std::chrono::milliseconds(1));
  }

 private:
  std::mutex mutex_;
  std::string text_;
};

TEST_F(ProgressLogLines, ComeWithoutFurtherReports) {
  ProgressLog log(1e-3, sink());
  log.begin({"packing", "tiles", ProgressUnit::count, 0});
  log.update(250, 1000, "a note");
  waitFor("packing: 250 of 1 000 tiles, ");
  waitFor(" left, a note; ");
  const std::size_t before = text().size();
  while (text().size() == before) std::this_thread::sleep_for(std::chrono::milliseconds(1));
  EXPECT_EQ(text().back(), '\n');
}

TEST_F(ProgressLogLines, SayAtTheEndOfAStepHowLongItTook) {
  ProgressLog log(1e6, sink());
  log.begin({"reading", "", ProgressUnit::bytes, 0});
  log.update(10, 10);
  log.begin({"packing", "", ProgressUnit::count, 0});
  EXPECT_EQ(text().find("reading: done in "), 0u) << text();
  EXPECT_EQ(text().find("packing"), std::string::npos) << text();
  log.end();
  EXPECT_NE(text().find("\npacking: done in "), std::string::npos) << text();
  const std::string all = text();
  log.end();
  EXPECT_EQ(text(), all);
}

}  // namespace
}  // namespace filiform::tools
