#include "tests/support/process.h"
#include "tests/support/temp_folder.h"

#include <string>

#include <gtest/gtest.h>

namespace filiform {
namespace {

using test::runFiliform;

TEST(IngestLog, NamesEachStepOnStandardErrorOnlyIfAsked) {
  const test::TempFolder folder;
  std::string text;
  for (int i = 1; i <= 3000; ++i)
    text +=
        std::to_string(i) + " 3 " + std::to_string(3 * i) + " 0 0 0.5 " + std::to_string(i == 1 ? -1 : i - 1) + "\n";
  test::writeBytes(folder / "a.swc", text);
  const auto quiet = runFiliform({"ingest", folder / "a.swc", "-o", folder / "a.fil"});
  EXPECT_EQ(quiet.exit_code, 0);
  EXPECT_EQ(quiet.err, "");
  const auto logged = runFiliform({"ingest", folder / "a.swc", "--log", "0.001", "-o", folder / "b.fil"});
  EXPECT_EQ(logged.exit_code, 0) << logged.err;
  for (const char* const step : {"reading", "writing tiles", "writing cells", "publishing"})
    EXPECT_NE(logged.err.find("filiform: " + std::string(step) + ": done in "), std::string::npos)
        << step << " is not in\n"
        << logged.err;
  EXPECT_EQ(logged.out.substr(0, logged.out.find("b.fil")), quiet.out.substr(0, quiet.out.find("a.fil")));
  EXPECT_EQ(runFiliform({"ingest", folder / "a.swc", "--log", "0", "-o", folder / "c.fil"}).exit_code, 2);
}

}  // namespace
}  // namespace filiform
