// What all files of a tile set share: their names, the format version and how they begin. FORMAT.md specifies the
// bytes. Decoders throw Damage and never read past their input.
#pragma once

#include "index/file/internal/bytes.h"

#include <cstdint>
#include <functional>
#include <string>
#include <string_view>

namespace filiform::internal {

inline constexpr std::uint32_t kFormatVersion = 3, kOldestVersion = 2;  // written; the oldest that is read
inline constexpr std::size_t kPackHeaderBytes = 16;

inline constexpr const char* kCurrentFile = "CURRENT";  // beside the folders of revisions; names one of them
inline constexpr std::uint64_t kMostCurrentBytes = 4096;
inline constexpr const char* kManifestFile = "manifest.json";
inline constexpr std::uint64_t kMostManifestBytes = std::uint64_t{16}
                                                    << 20;  // of 100 000 files; JSON takes 16 times as much
inline constexpr const char* kDirectoryFile = "directory.bin";
inline constexpr const char* kCellsFile = "cells.bin";
inline constexpr const char* kLandmarksFile = "samples.bin";
inline constexpr const char* kProvenanceFile = "provenance.json";
std::string packFile(std::uint32_t pack);
bool isPackFile(const std::string& name);  // of full-resolution tiles
// section-NAME.bin. NAME: at most 64 of [a-z0-9-], not empty.
std::string sectionFile(const std::string& section);
std::string sectionOf(const std::string& file);  // NAME; empty for other files
Bytes packHeader(std::uint32_t pack);
Bytes packHeader(std::string_view magic, std::uint32_t pack);  // of the given kind of pack
// Writes the beginning of every file except the manifest: kind and version.
void writeMagic(ByteWriter& out, std::string_view magic);
std::uint32_t checkMagic(ByteReader& in, std::string_view magic);  // returns the version

// What a decoder throws for a file of a format version that it does not read.
struct OtherVersion : Damage {
  std::string version;
  bool older;
};
[[noreturn]] void throwOtherVersion(std::uint64_t offset, const std::string& version, bool older);

// A byte of a tile's geometry holds at most this many segments: 32 steps take at least three bytes. A sample is an end
// of a segment or isolated.
inline constexpr std::uint64_t kMostSegmentsAByte = 11, kMostSamplesAByte = 2 * kMostSegmentsAByte;

// An appearance of many segments may take few bytes, but their geometry does not: the geometry of a tile that owns more
// segments is decoded before its appearance.
inline constexpr std::uint32_t kMostOwnedUnread = std::uint32_t{1} << 20;

// Where the bytes of a tile lie.
struct TileLocation {
  std::uint32_t pack = 0, geometry_bytes = 0, appearance_bytes = 0;
  std::uint64_t offset = 0;  // of the geometry; the appearance follows
  std::uint64_t geometry_checksum = 0, appearance_checksum = 0;
};

// Reads a part of a file. Its exceptions propagate.
using ReadPart = std::function<Bytes(std::uint64_t offset, std::uint64_t bytes)>;

}  // namespace filiform::internal
