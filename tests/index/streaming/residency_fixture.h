// A residency over a store in memory that counts its loads; for the tests of Residency.
#pragma once

#include "index/ingest/memory_tiles.h"
#include "index/streaming/residency.h"
#include "tests/support/scenes/counting_store.h"
#include "tests/support/scenes/random_cells.h"

#include <cstdint>
#include <limits>
#include <memory>
#include <utility>
#include <vector>

#include <gtest/gtest.h>

namespace filiform::test {

inline constexpr int kAllMessages = std::numeric_limits<int>::max();

class ResidencyTest : public testing::Test {
 protected:
  explicit ResidencyTest(std::vector<Cell> cells = randomColumn(5, 10, 500, 300), std::uint32_t capacity = 64) {
    CellList stream(std::move(cells));
    inner_ = buildTilesInMemory(stream, {.capacity = capacity});
    store_ = std::make_unique<CountingStore>(*inner_);
  }

  TileId count() const { return store_->tile_count(); }
  std::uint64_t bytesOf(TileId tile) const { return store_->entry(tile).decoded_bytes; }
  std::uint64_t total() const {
    std::uint64_t sum = 0;
    for (TileId tile = 0; tile < count(); ++tile) sum += bytesOf(tile);
    return sum;
  }
  ResidencyOptions options(std::uint64_t budget, PrefetchPolicy policy = PrefetchPolicy::none) const {
    return {.budget_bytes = budget, .prefetch = policy, .lookahead_s = 0.5};
  }
  Vector3d centre(TileId tile) const {
    const GridBox& b = store_->entry(tile).content;
    return 0.5 * (store_->grid().toWorld(b.lo) + store_->grid().toWorld(b.hi));
  }
  ReaderFocus focusOn(TileId tile, double radius_um = 0) const {
    ReaderFocus focus;
    focus.active_tile = tile;
    focus.p_W = centre(tile);
    focus.radius_um = radius_um;
    return focus;
  }

  std::unique_ptr<TileStore> inner_;
  std::unique_ptr<CountingStore> store_;
};

}  // namespace filiform::test
