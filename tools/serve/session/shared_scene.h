// SharedScene: one revision of a set, with the tiles that the sessions on it share. Thread rule: internally
// synchronised; tick() is the ticking thread's.
#pragma once

#include "solver/travel/hand/shared_tiles.h"
#include "solver/travel/places/place_finder.h"
#include "tools/serve/session/ticker.h"
#include "tools/serve/sets/served_set.h"

#include <cstdint>
#include <memory>

namespace filiform::tools {

class SharedScene final : public Ticked {
 public:
  // Starts the reading of tiles, and has `ticker` take the loader's messages. Throws UsageError if the budget is below
  // the minimum; CorruptTile, IoError.
  SharedScene(std::shared_ptr<const ServedSet> served, std::uint64_t budget_bytes, Ticker& ticker);
  ~SharedScene() override;

  const ServedSet& served() const { return *served_; }
  const TileSet& set() const { return served_->set(); }
  SharedTiles tiles() { return {&residency_, &reader_}; }
  Residency& residency() { return residency_; }
  const PlaceFinder& places() const { return places_; }

  void tick(std::uint64_t period) noexcept override;

 private:
  const std::shared_ptr<const ServedSet> served_;
  Ticker& ticker_;
  Residency residency_;
  TileReader& reader_;
  const PlaceFinder places_;
};

}  // namespace filiform::tools
