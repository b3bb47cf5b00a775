#include "index/verify/set_digest.h"

#include "index/ingest/ingest.h"
#include "index/verify/verify.h"
#include "tests/support/scenes/random_cells.h"
#include "tests/support/temp_folder.h"

#include <cstdlib>
#include <string>

#include <gtest/gtest.h>

namespace filiform {
namespace {

TEST(SetDigest, IsThatOfItsManifestAndFiles) {
  const test::TempFolder folder;
  CellList stream(test::randomColumn(5, 4, 200, 80));
  ingest(stream, folder / "a.fil");
  const auto set = TileSet::open(folder / "a.fil");
  const std::string digest = setDigest(*set, [](std::uint64_t) {});
  std::string files = "manifest.json";
  for (const SetFile& file : set->files()) files += " " + file.name;
  const std::string command = "cd '" + (folder / "a.fil") + "/" + set->revision() + "' && cat " + files +
                              " | sha256sum | cut -c1-64 >'" + (folder / "sum") + "'";
  if (std::system(command.c_str()) != 0) GTEST_SKIP() << "no sha256sum";
  EXPECT_EQ(test::readBytes(folder / "sum"), digest + "\n");
  EXPECT_TRUE(verify(folder / "a.fil", {.sha256 = digest}).sound());
  const VerifyReport other = verify(folder / "a.fil", {.sha256 = std::string(64, '0')});
  ASSERT_EQ(other.problem_count, 1u);
  EXPECT_NE(other.problems[0].find("its SHA-256 is " + digest), std::string::npos) << other.problems[0];
}

}  // namespace
}  // namespace filiform
