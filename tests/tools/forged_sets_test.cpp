// Commands on sets whose writer lies, with checksums that match: one line, exit code 1 or 3, and little memory.
#include "index/ingest/ingest.h"
#include "index/ingest/memory_tiles.h"
#include "tests/support/process.h"
#include "tests/support/sanitized.h"
#include "tests/support/scenes/faulty_set.h"
#include "tests/support/scenes/random_cells.h"
#include "tests/support/servers/http_server.h"
#include "tests/support/temp_folder.h"

#include <memory>
#include <string>
#include <vector>

#include <gtest/gtest.h>

namespace filiform {
namespace {

using test::Outcome;
using test::runFiliform;

constexpr std::uint64_t kMostBytes = std::uint64_t{256} << 20;

class ForgedSets : public ::testing::Test {
 protected:
  ForgedSets() {
    CellList stream(test::randomColumn(5, 4, 200, 80));
    store_ = buildTilesInMemory(stream, {.capacity = 50});
  }
  std::string path(const std::string& name) const { return folder_ / name; }
  std::vector<std::vector<std::string>> commands(const std::string& set) const {
    return {{"cells", set},
            {"measure", set},
            {"contacts", set, "--within", "1"},
            {"compare", set, store_->cell(0).name, store_->cell(1).name},
            {"ingest", set, "-o", path("part.fil")},
            {"export", set, "--all", "-o", path("out" + std::to_string(++outputs_) + "/")},
            {"export", set, "--cell", store_->cell(0).name, "-o", path("out.swc")},
            {"navigate", set, "--cell", store_->cell(0).name, "--seconds", "0.1"},
            {"path", set, store_->cell(0).name + ":1", store_->cell(0).name + ":20"},
            {"verify", set},
            {"verify", set, "--deep"}};
  }
  void expectRefused(const std::vector<std::string>& arguments) const {
    const Outcome outcome = runFiliform(arguments);
    SCOPED_TRACE(arguments[0] + ": " + outcome.err);
    EXPECT_TRUE(outcome.exit_code == 1 || outcome.exit_code == 3) << outcome.exit_code;
    EXPECT_TRUE(outcome.oneLineOnStderr());
    if (!test::kSanitized) {
      EXPECT_LT(outcome.peak_bytes, kMostBytes);
    }
  }

  test::TempFolder folder_;
  std::unique_ptr<TileStore> store_;
  mutable int outputs_ = 0;
};

TEST_F(ForgedSets, ARunOfFourThousandMillionIdsIsRefusedByEachCommand) {
  test::writeBoastfulSet(*store_, path("evil.fil"), 4'000'000'000, false);
  for (const auto& command : commands(path("evil.fil"))) expectRefused(command);
  test::writeBoastfulSet(*store_, path("counted.fil"), 4'000'000'000, true);
  for (const auto& command : commands(path("counted.fil"))) expectRefused(command);
}

TEST_F(ForgedSets, ASizeThatAServerDoesNotHaveTakesNoMemory) {
  test::writeFaultySet(*store_, path("a.fil"), {});
  const test::HttpServer server(folder_.path());
  for (const char* const name : {"samples.bin", "provenance.json", "cells.bin"}) {
    test::changeManifest(path("a.fil"), [&](auto& manifest) {
      for (auto& file : manifest["files"])
        if (file["name"] == name) file["bytes"] = 5'000'000'000;
      if (name == std::string("cells.bin")) manifest["cells_root"]["bytes"] = 4'900'000'000;
    });
    if (name == std::string("samples.bin"))
      expectRefused({"nearest", server / "a.fil", "0", "0", "0", "--approximate"});
    if (name == std::string("provenance.json") && !test::kSanitized) {
      EXPECT_LT(runFiliform({"info", server / "a.fil"}).peak_bytes, kMostBytes) << "it needs no part of that file";
    }
    if (name == std::string("cells.bin")) expectRefused({"cells", server / "a.fil"});
    expectRefused({"verify", server / "a.fil"});
  }
}

}  // namespace
}  // namespace filiform
