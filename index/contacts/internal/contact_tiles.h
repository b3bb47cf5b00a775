// ContactTiles: makes the ContactTiles of a store, and keeps those used last within a byte budget.
#pragma once

#include "index/contacts/contact_options.h"
#include "index/contacts/internal/contact_tile.h"
#include "index/measure/internal/sample_radii.h"
#include "index/set/tile_store.h"

#include <cstdint>
#include <functional>
#include <list>
#include <memory>
#include <mutex>
#include <optional>
#include <unordered_map>
#include <vector>

namespace filiform::internal {

// Thread rule: internally synchronised. A tile that several threads need at once is made once.
class ContactTiles {
 public:
  // The store must outlive this object.
  ContactTiles(const TileStore& store, const ContactOptions& options);

  // Throws what the store throws.
  std::shared_ptr<const ContactTile> get(TileId tile);
  // No counted radius of the wanted cells is larger; 0 before findLargestRadius().
  double largestRadius_um() const { return largest_radius_um_; }
  // Reads the radii of all tiles. Throws what the store throws, and what `check` throws.
  void findLargestRadius(unsigned threads, const std::function<void()>& check);

 private:
  struct Kept {
    std::mutex mutex;  // while it is made
    std::shared_ptr<const ContactTile> tile;
    std::uint64_t bytes = 0;
    std::list<TileId>::iterator place;
  };
  std::shared_ptr<const ContactTile> make(TileId id) const;
  std::uint8_t sidesOf(std::uint32_t cell, std::uint16_t type) const {
    return static_cast<std::uint8_t>(sides_by_cell_[cell] & sides_by_type_[type]);
  }

  const TileStore& store_;
  const bool surface_;
  const std::uint64_t budget_bytes_;
  std::vector<std::uint8_t> sides_by_cell_, sides_by_type_;  // one bit a ContactSide
  mutable std::optional<SampleRadii> radii_;                 // only with surfaces
  double largest_radius_um_ = 0;
  std::mutex mutex_;
  std::list<TileId> order_;  // most recent first
  std::unordered_map<TileId, std::shared_ptr<Kept>> kept_;
  std::uint64_t bytes_ = 0;
};

}  // namespace filiform::internal
