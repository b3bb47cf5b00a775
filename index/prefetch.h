// What a reader will want next: claims on the byte budget, from where it is and how it moves.
//
//   structure: the tiles that the graph enters, walked from the proxy's node, by time to reach at the present speed;
//   where the walk
//              meets a tile that is absent, that tile is claimed and the walk ends there.
//   workspace: the tiles within the workspace's radius of the proxy, nearest first.
// Thread rule: thread-compatible; loader's side only (it allocates).
#pragma once

#include "index/directory.h"
#include "index/residency.h"

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

  // Appends each tile at most once a list, best first. `loaded` holds the tiles in memory; the workspace's list ends
  // where its tiles would fill budget_bytes. A focus that is not finite claims nothing. At most kMaxWalkedSegments
  // segments and kMaxWorkspaceTiles tiles are looked at.
  void claim(const ReaderFocus& focus, const TileTable& loaded, std::uint64_t budget_bytes,
             std::vector<TileClaim>& structure, std::vector<TileClaim>& workspace) const;

 private:
  void claimStructure(const ReaderFocus& focus, const TileTable& loaded, std::vector<TileClaim>& claims) const;
  void claimWorkspace(const ReaderFocus& focus, std::uint64_t budget_bytes, std::vector<TileClaim>& claims) const;

  const TileStore& store_;
  const Directory& directory_;
  PrefetchPolicy policy_;
  double lookahead_s_;
};

}  // namespace filiform
