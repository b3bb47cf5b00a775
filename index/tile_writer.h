// Writes the files of one revision into a folder of its own. Publishing the folder is ingest's job.
#pragma once

#include "index/partition.h"
#include "index/provenance.h"
#include "index/tile_set.h"

#include <cstdint>
#include <functional>
#include <memory>
#include <span>
#include <string>
#include <vector>

namespace filiform {

// A pack ends before the tile that would make it larger.
inline constexpr std::uint64_t kMostPackBytes = std::uint64_t{256} << 20;

// Thread-compatible. Every member throws IoError.
class TileWriter {
 public:
  // The folder must exist and be empty. Tiles have the ids 0 .. tile_count-1; the long-segment tile, if any, is the
  // last.
  TileWriter(std::string folder, const Grid& grid, std::uint32_t capacity, TileId tile_count, bool has_long,
             std::uint64_t pack_bytes = kMostPackBytes);
  TileWriter(const TileWriter&) = delete;
  TileWriter& operator=(const TileWriter&) = delete;
  ~TileWriter();

  // The order in which packs hold the tiles: along the Hilbert curve of the centres of their cells, the long-segment
  // tile last.
  static std::vector<TileId> packOrder(std::span<const CellKey> leaves, bool has_long);

  // Appends a tile, each id once, in packOrder.
  void add(TileId tile, const TileEntry& entry, std::span<const std::uint8_t> geometry,
           std::span<const std::uint8_t> appearance);
  // Each once; cells in the order of their ids. `details` is called once and hands over each cell's detail, encoded.
  using UseDetail = std::function<void(std::span<const std::uint8_t> detail)>;
  void writeCells(const std::vector<CellRecord>& records, const std::vector<std::uint64_t>& digests,
                  const std::function<void(const UseDetail& use)>& details);
  void writeSamples(const SamplePoints& samples);
  struct LevelMemory {
    std::uint64_t bytes = UINT64_MAX;
    // For a message: the memory of the process that leaves so many bytes to the levels.
    std::function<std::uint64_t(std::uint64_t bytes)> ofProcess = {};
  };
  // The levels of detail, from the tiles that were added: all of them. Reads them back. Throws CorruptTile too,
  // InputError when they take more memory, and what `progress` throws (it is told the tiles done). O(segments).
  void writeLevels(const LevelMemory& memory, unsigned threads,
                   const std::function<void(std::uint64_t done)>& progress);

  // Writes directory and manifest, flushes the folder, and returns the revision's name.
  std::string finish(const Provenance& provenance);
  const SetCounts& counts() const;  // after finish
  std::uint64_t bytes() const;      // of all files, after finish

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace filiform
