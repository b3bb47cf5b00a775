// What the tests of sets at an address share: a small set in a folder, and a server of it that makes faults.
#pragma once

#include "index/errors.h"
#include "index/ingest/ingest.h"
#include "index/set/tile_set.h"
#include "tests/support/scenes/random_cells.h"
#include "tests/support/servers/http_server.h"
#include "tests/support/temp_folder.h"

#include <exception>
#include <memory>
#include <string>

#include <gtest/gtest.h>

namespace filiform::test {

class HttpSourceTest : public ::testing::Test {
 protected:
  static void SetUpTestSuite() {
    folder_ = std::make_unique<TempFolder>();
    CellList stream(randomColumn(7, 8, 500, 400));
    ingest(stream, *folder_ / "a.fil", {.capacity = 50, .page_tiles = 4, .levels = true});
    local_ = TileSet::open(*folder_ / "a.fil");
  }
  static void TearDownTestSuite() {
    local_.reset();
    folder_.reset();
  }

  RemoteOptions quick() const { return {.deadline_s = 2, .stall_s = 1}; }
  std::unique_ptr<TileSet> openRemote(const RemoteOptions& options = {}) const {
    return TileSet::open(server_ / "a.fil", options);
  }
  // The message of the error that opening the set throws.
  template <typename Thrown = Error>
  std::string refusal(const RemoteOptions& options) const {
    try {
      const auto set = openRemote(options);
      for (TileId t = 0; t < set->tile_count(); ++t) set->load(t);
    } catch (const Thrown& error) {
      return error.what();
    } catch (const std::exception& error) {
      ADD_FAILURE() << "another error: " << error.what();
    }
    return {};
  }

  static inline std::unique_ptr<TempFolder> folder_;
  static inline std::unique_ptr<TileSet> local_;
  mutable HttpServer server_{folder_->path()};
};

}  // namespace filiform::test
