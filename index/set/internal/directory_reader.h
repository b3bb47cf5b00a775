// DirectoryReader: the directory of an open set. It reads pages when they are first needed, and keeps them.
#pragma once

#include "index/file/internal/read_once.h"
#include "index/set/internal/directory_file.h"
#include "index/set/internal/revision.h"
#include "index/tile/leaf_index.h"

#include <atomic>
#include <memory>
#include <mutex>
#include <string>
#include <vector>

namespace filiform::internal {

// Thread rule: internally synchronised. Members throw CorruptSet, IoError when they read a page, and std::out_of_range
// if the tile does not exist.
class DirectoryReader {
 public:
  explicit DirectoryReader(const Revision& revision);  // reads nothing; the revision must outlive it

  const DirectoryRoot& root() const { return root_; }
  const LeafIndex& leaves() const { return leaves_; }
  const TileEntry& entry(TileId tile) const { return page(tile).entries[tile % root_.page_tiles]; }
  const TileLocation& location(TileId tile) const { return page(tile).locations[tile % root_.page_tiles]; }
  const DirectoryRecord& record(std::uint32_t page) const;  // reads the page's group at its first use
  // Return when leaves() knows the group, or the page of the tile.
  void knowGroup(std::uint32_t number) const {
    group(number);
    const std::lock_guard lock(mutex_);  // another thread may be adding it
  }
  void knowPage(TileId tile) const {
    page(tile);
    const std::lock_guard lock(mutex_);
  }
  TileId home(const GridPoint& p) const;
  // Reads the pages that home() of the tile's nodes needs, because the haptic thread cannot read.
  void knowHomes(const Tile& tile) const;
  void checkLocation(TileId tile, const TileLocation& at) const;  // throws CorruptSet if it lies outside the packs
  const std::string& packName(std::uint32_t pack) const { return pack_names_[pack]; }  // for messages

 private:
  const DirectoryPage& page(TileId tile) const;
  const DirectoryPage& readPage(std::uint32_t number) const;
  void keepPage(std::uint32_t number, std::unique_ptr<DirectoryPage> page) const;
  const DirectoryGroup& group(std::uint32_t number) const;
  // Returns decode(ReadPart). After Damage, decodes once more if the revision can read other bytes.
  template <typename Decode>
  auto readDirectory(Decode decode) const;

  const Revision& revision_;
  DirectoryRoot root_;
  std::vector<std::uint64_t> pack_bytes_;
  std::vector<std::string> pack_names_;
  mutable std::mutex mutex_;  // held while a page is added, never while reading
  // Several threads may read a part at once, since one may read with a lower priority: the first to finish keeps it.
  mutable std::unique_ptr<ReadOnce<DirectoryGroup>[]> groups_;
  mutable std::unique_ptr<ReadOnce<DirectoryPage>[]> pages_;
  mutable std::atomic<std::uint32_t> pages_unknown_{0};
  mutable LeafIndex leaves_;
};

}  // namespace filiform::internal
