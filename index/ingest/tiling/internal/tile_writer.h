// TileWriter: writes the files of one revision into a folder. ingest() publishes the folder.
#pragma once

#include "index/geometry/partition.h"
#include "index/levels/internal/level_writer.h"
#include "index/set/internal/directory_file.h"
#include "index/set/internal/patches_file.h"
#include "index/set/provenance.h"
#include "index/set/tile_set.h"

#include <cstdint>
#include <functional>
#include <memory>
#include <span>
#include <string>
#include <vector>

namespace filiform {

// A new pack starts before a tile that would exceed this size.
inline constexpr std::uint64_t kMostPackBytes = std::uint64_t{256} << 20;

// Thread rule: thread-compatible. Every member throws IoError.
class TileWriter {
 public:
  // Requires an existing, empty folder.
  TileWriter(std::string folder, const Grid& grid, std::uint32_t capacity, std::uint64_t pack_bytes = kMostPackBytes,
             const internal::DirectoryShape& shape = {});
  TileWriter(const TileWriter&) = delete;
  TileWriter& operator=(const TileWriter&) = delete;
  ~TileWriter();

  // For about this number of tiles.
  void reserve(std::size_t tiles);
  // Appends the next tile in the order of ids; the long-segment tile is the last. Throws InputError for a tile of more
  // than 4 GiB.
  void add(const TileEntry& entry, std::span<const std::uint8_t> geometry, std::span<const std::uint8_t> appearance,
           bool is_long);
  // Adds a tile like add(), whose bytes another process has written.
  void addPlaced(const TileEntry& entry, const internal::TileLocation& at, bool is_long);
  const internal::TileLocation& location(TileId tile) const;
  // For a revision that refers to packs of others: its own packs have numbers from `pack` on. Call it before append().
  void growFrom(std::uint32_t pack);
  // For a grown revision: appends the bytes of a tile; lists a file of another revision; sets all tiles.
  internal::TileLocation append(std::span<const std::uint8_t> geometry, std::span<const std::uint8_t> appearance);
  void refer(const SetFile& file);  // or of this revision, written by another process
  void setTiles(internal::DirectoryContents tiles, const std::vector<internal::Patch>& patches);
  std::vector<std::string> revisionsInUse() const;  // of the files listed by refer()

  // Writes the cells, in the order of their ids; call it once. `details` is called once and passes each cell's encoded
  // detail to `use`.
  using UseDetail = std::function<void(std::span<const std::uint8_t> detail)>;
  void writeCells(const std::vector<CellRecord>& records, const std::vector<std::uint64_t>& digests,
                  const std::function<void(const UseDetail& use)>& details);
  // Writes a section, once a name. Throws UsageError for an invalid name.
  void writeSection(const std::string& name, std::span<const std::uint8_t> bytes);
  // Writes the landmarks; call it once.
  void writeLandmarks(const Landmarks& landmarks);
  // Makes the levels of detail of the added tiles, which must be all. `input` has no grid, leaves and segments. Throws
  // what filiform::writeLevels() throws.
  void writeLevels(LevelInput input, LevelOptions options);

  // Writes directory and manifest, flushes the folder, and returns the revision's name.
  std::string finish(const Provenance& provenance);
  std::uint64_t tiles() const;      // added so far
  const SetCounts& counts() const;  // valid after finish()
  std::uint64_t bytes() const;      // of all files; valid after finish()

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace filiform
