// What all files of a tile set share: their names, the format version and how they begin. FORMAT.md specifies the
// bytes. Decoders throw Damage and never read past their input.
#pragma once

#include "index/file/internal/bytes.h"

#include <cstdint>
#include <functional>
#include <span>
#include <string>
#include <string_view>

namespace filiform::internal {

inline constexpr std::uint32_t kFormatVersion = 1;
inline constexpr std::size_t kPackHeaderBytes = 16;

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

// Where the bytes of a tile lie.
struct TileLocation {
  std::uint32_t pack = 0, geometry_bytes = 0, appearance_bytes = 0;
  std::uint64_t offset = 0;  // of the geometry; the appearance follows
  std::uint64_t geometry_checksum = 0, appearance_checksum = 0;
};

// Reads a part of a file. Its exceptions propagate.
using ReadPart = std::function<void(std::uint64_t offset, std::span<std::uint8_t> bytes)>;

}  // namespace filiform::internal
