// SharedScene: one revision of a set, with the tiles that the sessions on it share. Thread rule: internally
// synchronised.
#pragma once

#include "solver/travel/hand/shared_tiles.h"
#include "solver/travel/places/place_finder.h"
#include "tools/serve/session/ticker.h"
#include "tools/serve/sets/served_set.h"

#include <cstddef>
#include <cstdint>
#include <memory>
#include <vector>

namespace filiform::tools {

class SharedScene {
 public:
  // Starts the reading of tiles, and has each of `tickers` take the loader's messages for its sessions. Throws
  // UsageError if the budget is below the minimum; CorruptTile, IoError.
  SharedScene(std::shared_ptr<const ServedSet> served, std::uint64_t budget_bytes, const std::vector<Ticker*>& tickers);
  ~SharedScene();

  const ServedSet& served() const { return *served_; }
  const TileSet& set() const { return served_->set(); }
  // For a session that the ticker with this place among `tickers` ticks.
  SharedTiles tiles(std::size_t ticker) { return {&residency_, &parts_[ticker]->reader}; }
  Residency& residency() { return residency_; }
  const PlaceFinder& places() const { return places_; }

 private:
  struct Part final : Ticked {
    Part(Ticker& by, TileReader& of) : ticker(by), reader(of) {}
    void tick(std::uint64_t period) noexcept override;
    Ticker& ticker;
    TileReader& reader;
  };

  const std::shared_ptr<const ServedSet> served_;
  Residency residency_;
  std::vector<std::unique_ptr<Part>> parts_;
  const PlaceFinder places_;
};

}  // namespace filiform::tools
