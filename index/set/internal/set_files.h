// Encodes and decodes the files of a tile set except packs: directory.bin, cells.bin, samples.bin and manifest.json.
// FORMAT.md specifies the bytes. Decoders throw Damage and never read past their input.
#pragma once

#include "index/file/internal/bytes.h"
#include "index/set/provenance.h"
#include "index/set/tile_set.h"

#include <algorithm>
#include <functional>
#include <string>
#include <string_view>
#include <vector>

namespace filiform::internal {

inline constexpr std::uint32_t kFormatVersion = 1;
inline constexpr std::size_t kPackHeaderBytes = 16;
inline constexpr std::size_t kMaxRootBytes = 16384;

inline constexpr const char* kManifestFile = "manifest.json";
inline constexpr const char* kDirectoryFile = "directory.bin";
inline constexpr const char* kCellsFile = "cells.bin";
inline constexpr const char* kLandmarksFile = "samples.bin";
inline constexpr const char* kProvenanceFile = "provenance.json";
std::string packFile(std::uint32_t pack);
Bytes packHeader(std::uint32_t pack);
Bytes packHeader(std::string_view magic, std::uint32_t pack);  // of the given kind of pack
// Writes the beginning of every file except the manifest: kind and version.
void writeMagic(ByteWriter& out, std::string_view magic);
void checkMagic(ByteReader& in, std::string_view magic);

struct TileLocation {
  std::uint32_t pack = 0, geometry_bytes = 0, appearance_bytes = 0;
  std::uint64_t offset = 0;  // of the geometry; the appearance follows
  std::uint64_t geometry_checksum = 0, appearance_checksum = 0;
};

struct DirectoryContents {
  Grid grid;
  std::uint32_t capacity = 0;
  TileId long_tile = kNoTile;
  std::vector<TileEntry> entries;
  std::vector<TileLocation> locations;
};
Bytes encodeDirectory(const DirectoryContents& directory);
// Exceptions from `read` propagate.
using ReadPart = std::function<void(std::uint64_t offset, std::span<std::uint8_t> bytes)>;
// Decodes all pages in order.
DirectoryContents decodeDirectory(std::uint64_t file_bytes, const ReadPart& read);

// The root page: what is known of the other pages without reading them.
struct DirectoryRoot {
  struct Page {
    MortonKey low = 0;  // key of its first tile
    GridBox content;    // box of its tiles' content
    std::uint64_t checksum = 0;
  };
  Grid grid;
  std::uint32_t capacity = 0;
  TileId tiles = 0, page_tiles = 0, long_tile = kNoTile;
  std::vector<Page> pages;

  TileId leaf_count() const { return tiles - (long_tile != kNoTile ? 1 : 0); }
  TileId pageBegin(std::uint32_t page) const { return page * page_tiles; }
  TileId pageEnd(std::uint32_t page) const {
    return static_cast<TileId>(std::min<std::uint64_t>(tiles, (std::uint64_t{page} + 1) * page_tiles));
  }
};
// Checks the root page and the order of its pages.
DirectoryRoot decodeDirectoryRoot(std::uint64_t file_bytes, const ReadPart& read);
struct DirectoryPage {
  std::vector<TileEntry> entries;
  std::vector<TileLocation> locations;
};
// Checks the page, the order of its leaves, and its agreement with the root page.
DirectoryPage decodeDirectoryPage(const DirectoryRoot& root, std::uint32_t page, const ReadPart& read);
// Reads TileEntry::decoded_bytes of a page's tiles; checks only the checksum. Overwrites `scratch`.
void readDecodedBytes(const DirectoryRoot& root, std::uint32_t page, const ReadPart& read, Bytes& scratch,
                      std::vector<std::uint64_t>& decoded_bytes);

struct DetailPlace {
  std::uint64_t offset, bytes, checksum;
};
struct CellTable {
  std::vector<CellRecord> records;
  std::vector<DetailPlace> details;
  std::vector<std::uint32_t> by_name;  // cell ids, by name
};
// Encodes all but the details, which follow. Positions of details count from the first detail.
Bytes encodeCellTable(const std::vector<CellRecord>& records, const std::vector<std::uint64_t>& digests,
                      const std::vector<DetailPlace>& places);
inline constexpr std::size_t kCellsHeaderBytes = 56;
// Number of bytes for decodeCells(): header, records, name index and strings. Checks the header.
std::uint64_t cellTableBytes(ByteSpan header, std::uint64_t file_bytes);
CellTable decodeCells(ByteSpan table);
// The part of a cell's record that is needed to load its detail; the record is at cellRecordAt(). The records' checksum
// covers all records together, so here the detail's checksum shows damage.
struct DetailRecord {
  std::uint64_t samples, roots;
  DetailPlace place;
};
inline constexpr std::size_t kCellRecordBytes = 128;
constexpr std::uint64_t cellRecordAt(std::uint32_t cell) {
  return kCellsHeaderBytes + std::uint64_t{cell} * kCellRecordBytes;
}
DetailRecord decodeDetailRecord(ByteSpan record);
Bytes encodeDetail(const CellDetail& detail);
CellDetail decodeDetail(ByteSpan bytes, std::uint64_t samples);

Bytes encodeLandmarks(const Landmarks& samples);
Landmarks decodeLandmarks(ByteSpan bytes);

struct Manifest {
  Grid grid;
  std::uint32_t capacity = 0;
  GridBox bounds;
  SetCounts counts;
  double covering_radius_um = 0;
  std::uint64_t refused = 0;  // number of refused inputs
  std::vector<SetFile> files;
};
// The manifest holds only the numbers of the provenance. writeProvenance() writes the rest: a line for each source and
// refused input.
std::string encodeManifest(const Manifest& manifest, const Provenance& provenance);
void writeProvenance(const Provenance& provenance, const std::function<void(std::string_view piece)>& use);
Manifest decodeManifest(const std::string& text);

std::string revisionName(const std::string& manifest);
bool isRevisionName(const std::string& name);

}  // namespace filiform::internal
