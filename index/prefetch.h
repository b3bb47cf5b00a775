// What a reader will want next: claims on the byte budget, from where it is and how it moves.
//
//   ahead:  the tiles that the neurite enters, by time to reach at the present speed. Where it is in memory it is
//           walked; where the walk ends at an absent tile or at its reach, the other tiles that hold the same cell
//           follow, by their distance from those ends: so a far disk is asked for several tiles at once, not for one
//           after the other.
//   around: the tiles within the workspace's radius of the proxy, nearest first; of a hand whose structure is followed
//           (PrefetchPolicy::structure, an active tile), within an eighth of it.
// Thread rule: thread-compatible; loader's side only (it allocates).
#pragma once

#include "index/directory.h"
#include "index/residency.h"

#include <span>
#include <vector>

namespace filiform {

struct TileClaim {
  TileId tile;
  double cost;  // lower is sooner: s along the structure, um in the workspace
};

class Prefetch {
 public:
  static constexpr std::size_t kMaxWorkspaceTiles = 4096;
  static constexpr std::size_t kMaxWalkedSegments = 8192;

  // Store and directory must outlive it.
  Prefetch(const TileStore& store, const Directory& directory, PrefetchPolicy policy, double lookahead_s);

  // Both append each tile at most once, best first, and no more than fill budget_bytes. A focus that is not finite
  // claims nothing; a velocity that is not finite counts as rest. Throw CorruptSet, IoError where a page of the
  // directory is needed for the first time and cannot be read.
  //
  // `loaded` holds the tiles in memory, `cell_tiles` those that own a segment of the active node's cell (empty: not
  // known). At most kMaxWalkedSegments segments are walked. O(walked log walked + cell_tiles * ends of the walk).
  void claimAhead(const ReaderFocus& focus, const TileTable& loaded, std::span<const TileId> cell_tiles,
                  std::uint64_t budget_bytes, std::vector<TileClaim>& claims) const;
  // O(kMaxWorkspaceTiles log tiles).
  void claimAround(const ReaderFocus& focus, std::uint64_t budget_bytes, std::vector<TileClaim>& claims) const;

  // From a point to what the tile holds, by its box; 0 inside.
  double distance_um(TileId tile, const Vector3d& p_W) const;

 private:
  const TileStore& store_;
  const Directory& directory_;
  PrefetchPolicy policy_;
  double lookahead_s_;
};

}  // namespace filiform
