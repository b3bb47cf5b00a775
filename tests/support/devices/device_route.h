// A route that a device travels, as a process, and its repetition.
#pragma once

#include "tests/support/process.h"
#include "tests/support/temp_folder.h"

#include <string>

#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

namespace filiform::test {

// SWC of a neurite of 40 segments, 5 um each, that zigzags.
inline std::string straightCell() {
  std::string swc = "1 1 0 0 0 1 -1\n";
  for (int i = 2; i <= 41; ++i)
    swc += std::to_string(i) + " 3 " + std::to_string(5 * (i - 1)) + " " + std::to_string(i % 2) + " 0 1 " +
           std::to_string(i - 1) + "\n";
  return swc;
}

// Travels the longest route of straightCell() with a device that renders force, and expects the recording to repeat
// it to the byte.
inline void expectRouteAndReplay(const std::string& device) {
  const TempFolder folder;
  writeBytes(folder / "c.swc", straightCell());
  const Outcome live = runFiliform({"navigate", folder / "c.swc", "--device", device, "--realtime", "--record",
                                    folder / "r.rec", "--csv", folder / "live.csv", "--seconds", "60", "--json"});
  ASSERT_EQ(live.exit_code, 0) << live.err;
  const auto summary = nlohmann::json::parse(live.out);
  EXPECT_EQ(summary.at("outcome"), "completed") << live.err;
  EXPECT_GT(summary.at("max_force_N"), 0);
  const Outcome replayed = runFiliform({"navigate", folder / "c.swc", "--device", "replay:" + (folder / "r.rec"),
                                        "--csv", folder / "replayed.csv", "--json"});
  ASSERT_EQ(replayed.exit_code, 0) << replayed.err;
  EXPECT_EQ(nlohmann::json::parse(replayed.out).at("outcome"), "completed") << replayed.err;
  EXPECT_EQ(readBytes(folder / "replayed.csv"), readBytes(folder / "live.csv"));
}

}  // namespace filiform::test
