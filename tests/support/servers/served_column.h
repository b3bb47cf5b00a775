// A test with a synthetic column that `filiform serve` can serve.
#pragma once

#include "tests/support/process.h"
#include "tests/support/servers/server_process.h"
#include "tests/support/temp_folder.h"

#include <cstdlib>
#include <optional>
#include <string>
#include <vector>

#include <gtest/gtest.h>

namespace filiform::test {

class ServedColumn : public ::testing::Test {
 protected:
  explicit ServedColumn(int cells = 4) : cells_(cells) {}
  void SetUp() override {
    const Outcome made = runFiliform({"synth", folder_ / "t.zip", "--cells", std::to_string(cells_), "--seed", "1"});
    ASSERT_EQ(made.exit_code, 0) << made.err;
    ASSERT_EQ(runFiliform({"ingest", folder_ / "t.zip", "-o", set_}).exit_code, 0);
  }
  ServerProcess& start(std::vector<std::string> options = {}) {
    options.insert(options.begin(), set_);
    return server_.emplace(options, folder_ / "err");
  }
  // What a shell line prints; "exit CODE" at its end if it fails.
  std::string shell(const std::string& line) const {
    const std::string out = folder_ / "out";
    const int code = std::system(("(" + line + ") >" + out + " 2>&1").c_str());
    return readBytes(out) + (code == 0 ? "" : "exit " + std::to_string(WEXITSTATUS(code)));
  }

  const int cells_;
  TempFolder folder_;
  const std::string set_ = folder_ / "t.fil";
  std::optional<ServerProcess> server_;
};

}  // namespace filiform::test
