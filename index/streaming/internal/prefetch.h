// Predicts which tiles a reader will need, from its position and motion: claims on the byte budget.
//
//   ahead:  tiles that the neurite enters, by time to reach them at the present speed. The neurite is walked as far as
//           it is in memory or the reach goes. The other tiles that hold the same cell follow, by distance from the
//           ends of the walk. So several tiles can be read from a slow disk at once. Turns and the way back change the
//           order, not the reach. The reach grows with the pull of the hand.
//   around: tiles within the workspace's radius of the proxy, nearest first. With PrefetchPolicy::structure and an
//           active tile, only those within an eighth of the radius, and within less where reads are fast.
// Thread rule: thread-compatible; only for the loader, since it allocates.
#pragma once

#include "index/query/tile_finder.h"
#include "index/streaming/internal/known_pages.h"
#include "index/streaming/residency_options.h"
#include "index/streaming/tile_reader.h"

#include <algorithm>
#include <span>
#include <vector>

namespace filiform {

// A tile that a reader is predicted to need.
struct TileClaim {
  TileId tile;
  double cost;  // lower is more urgent: s ahead, um around
};

class Prefetch {
 public:
  static constexpr std::size_t kMaxWorkspaceTiles = 4096;
  static constexpr std::size_t kMaxWalkedSegments = 8192;

  // The store and the finder over it must outlive this object. `lookahead_s`: see ResidencyOptions.
  Prefetch(const internal::KnownPages& store, const TileFinder& finder, PrefetchPolicy policy, double lookahead_s);

  // Append tiles to `claims`, each at most once, the most urgent first, as far as budget_bytes goes. A focus that is
  // not finite claims nothing; a velocity that is not finite counts as rest. Tiles in pages of the directory that are
  // not known are left out; these pages are noted (known_pages.h), also those that the proxy may reach in twice the
  // look-ahead time. Throw CorruptSet, IoError if a page cannot be read, and only if the store may read pages.
  //
  // claimAhead: `loaded` holds the tiles in memory. `cell_tiles` are the tiles that own a segment of the active node's
  // cell; empty: not known. Walks at most kMaxWalkedSegments segments. O(walked log walked + cell_tiles * ends of the
  // walk).
  void claimAhead(const ReaderFocus& focus, const TileTable& loaded, std::span<const TileId> cell_tiles,
                  std::uint64_t budget_bytes, std::vector<TileClaim>& claims) const;
  // claimAround: O(kMaxWorkspaceTiles log tiles). Returns false if it ended at a page that is not known.
  bool claimAround(const ReaderFocus& focus, std::uint64_t budget_bytes, std::vector<TileClaim>& claims) const;

  // `s`: as in the constructor, which states the usual time. From a source that needs more, the reach is longer; from a
  // faster one it is shorter, with the pace unchanged.
  void setLookahead(double s) { lookahead_s_ = s > 0 ? s : 1e-3; }

  // Distance from a point to the box of the tile's content; 0 inside. In a page that is not known: a lower bound.
  double distance_um(TileId tile, const Vector3d& p_W) const;

 private:
  // Of the tile's content, or of its page's if that is all that is known; infinite if nothing is known.
  WorldBox boxOf(TileId tile) const;
  // The part of the usual distances for which there is time; 1 unless reads are fast.
  double timePart() const { return std::min(1.0, lookahead_s_ / usual_lookahead_s_); }

  const internal::KnownPages& store_;
  const TileFinder& finder_;
  PrefetchPolicy policy_;
  double lookahead_s_, usual_lookahead_s_;
};

}  // namespace filiform
