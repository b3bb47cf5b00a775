#include "index/levels/internal/level_files.h"

#include "index/file/internal/digest.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <string_view>

namespace filiform::internal {
namespace {

constexpr std::string_view kLevelMagic = "FILILEVL", kLevelPackMagic = "FILILPAK";
constexpr std::size_t kLevelHeaderBytes = 40, kPageChecksumBytes = 8, kLevelEntryBytes = 160, kChecksumAt = 32;
constexpr std::uint32_t kTilesPerPage = 4096;
// Ingest makes no other tiles. A reader's work grows with the tiles of a block, and as pixels shrink.
constexpr std::uint32_t kMostCoarser = 64;
constexpr double kLeastPixel = 1.0 / 2048;  // of the set's quantum

std::size_t rootBytes(std::size_t pages) { return kLevelHeaderBytes + pages * kPageChecksumBytes; }

void writeLevelEntry(ByteWriter& out, const LevelEntry& e, const TileLocation& at) {
  out.key(e.key.low);
  out.u32(static_cast<std::uint32_t>(e.key.depth));
  out.u32(at.pack);
  out.point(e.content.lo);
  out.point(e.content.hi);
  out.u32(e.segments);
  out.u16(static_cast<std::uint16_t>(e.coarser));
  out.u16(static_cast<std::uint16_t>(e.exponent));
  out.f64(e.error_um);
  out.u64(e.represented);
  out.u64(e.hidden);
  out.f64(e.hidden_um);
  out.f64(e.pixel_um);
  out.u32(at.geometry_bytes);
  out.u32(at.appearance_bytes);
  out.u64(e.decoded_bytes);
  out.u64(at.offset);
  out.u64(at.geometry_checksum);
  out.u64(at.appearance_checksum);
}

void readLevelEntry(ByteReader& in, const Grid& grid, LevelEntry& e, TileLocation& at) {
  e.key.low = in.key();
  const std::uint32_t depth = in.u32();
  in.require(depth <= static_cast<std::uint32_t>(kMortonBits) && e.key.low >> kMortonBits == 0,
             "a block lies outside the grid");
  e.key.depth = static_cast<int>(depth);
  in.require(e.key.high() - e.key.low == BlockKey{0, e.key.depth}.high(), "a block's key is invalid");
  at.pack = in.u32();
  e.content = in.box();
  e.segments = in.u32();
  e.coarser = in.u16();
  in.require(e.coarser <= kMostCoarser, "a block has too many tiles");
  e.exponent = static_cast<std::int16_t>(in.u16());
  in.require(e.exponent >= grid.exponent() && e.exponent <= Grid::kMaxExponent, "the quantum is out of range");
  e.error_um = in.f64();
  e.represented = in.u64();
  e.hidden = in.u64();
  e.hidden_um = in.f64();
  e.pixel_um = in.f64();
  const auto isLength = [](double um) { return std::isfinite(um) && um >= 0; };
  in.require(isLength(e.error_um) && isLength(e.hidden_um) && isLength(e.pixel_um) && (e.hidden == 0 || e.pixel_um > 0),
             "a tile's figures contradict each other");
  in.require(e.hidden == 0 || e.pixel_um >= kLeastPixel * grid.quantum_um(), "pixels are too small");
  at.geometry_bytes = in.u32();
  at.appearance_bytes = in.u32();
  e.decoded_bytes = in.u64();
  at.offset = in.u64();
  at.geometry_checksum = in.u64();
  at.appearance_checksum = in.u64();
}

}  // namespace

bool comesBefore(const LevelEntry& a, const LevelEntry& b) {
  if (a.key.low != b.key.low) return a.key.low < b.key.low;
  return a.key.depth != b.key.depth ? a.key.depth < b.key.depth : a.coarser > b.coarser;
}

std::string levelPackFile(std::uint32_t pack) {
  char name[32];
  std::snprintf(name, sizeof name, "levels-%05u.pack", pack);
  return name;
}

Bytes levelPackHeader(std::uint32_t pack) { return packHeader(kLevelPackMagic, pack); }

Bytes encodeLevels(const LevelTable& table) {
  const std::size_t tiles = table.entries.size(), pages = (tiles + kTilesPerPage - 1) / kTilesPerPage;
  ByteWriter root, body;
  writeMagic(root, kLevelMagic);
  root.u32(kTilesPerPage);
  root.u32(static_cast<std::uint32_t>(tiles));
  root.u32(static_cast<std::uint32_t>(pages));
  root.u32(table.least_segments);
  root.i32(table.grid.exponent());
  root.u64(0);
  for (std::size_t page = 0; page < pages; ++page) {
    const std::size_t begin = page * kTilesPerPage, end = std::min<std::size_t>(begin + kTilesPerPage, tiles),
                      from = body.size();
    for (std::size_t t = begin; t < end; ++t) writeLevelEntry(body, table.entries[t], table.locations[t]);
    root.u64(checksum(ByteSpan(body.bytes()).subspan(from)));
  }
  root.setU64(kChecksumAt, checksum(root.bytes()));
  root.append(body.bytes());
  return root.take();
}

LevelTable decodeLevels(ByteSpan bytes) {
  ByteReader in(bytes);
  checkMagic(in, kLevelMagic);
  LevelTable table;
  const std::uint32_t per_page = in.u32(), tiles = in.u32(), pages = in.u32();
  table.least_segments = in.u32();
  const std::int32_t exponent = in.i32();
  in.require(exponent >= Grid::kMinExponent && exponent <= Grid::kMaxExponent, "the quantum is out of range");
  table.grid = Grid(exponent);
  in.require(per_page == kTilesPerPage && pages == (std::uint64_t{tiles} + per_page - 1) / per_page &&
                 bytes.size() == rootBytes(pages) + std::uint64_t{tiles} * kLevelEntryBytes,
             "the number of tiles does not fit the file");
  const std::uint64_t stated = in.u64();
  Bytes root(bytes.begin(), bytes.begin() + static_cast<std::ptrdiff_t>(rootBytes(pages)));
  std::fill_n(root.begin() + kChecksumAt, 8, std::uint8_t{0});
  if (checksum(root) != stated) throw Damage{0, "the root page's checksum is wrong"};
  table.entries.resize(tiles);
  table.locations.resize(tiles);
  for (std::uint32_t page = 0; page < pages; ++page) {
    const std::uint32_t begin = page * per_page, end = std::min(begin + per_page, tiles);
    const std::uint64_t page_checksum = in.u64(), at = rootBytes(pages) + std::uint64_t{begin} * kLevelEntryBytes;
    const ByteSpan body = bytes.subspan(at, std::uint64_t{end - begin} * kLevelEntryBytes);
    if (checksum(body) != page_checksum) throw Damage{at, "page " + std::to_string(page) + "'s checksum is wrong"};
    ByteReader entries(body);
    try {
      for (std::uint32_t t = begin; t < end; ++t)
        readLevelEntry(entries, table.grid, table.entries[t], table.locations[t]);
    } catch (const Damage& damage) {
      throw Damage{at + damage.offset, damage.what};
    }
  }
  for (std::uint32_t t = 1; t < tiles; ++t) {
    in.require(comesBefore(table.entries[t - 1], table.entries[t]), "tiles are out of order");
  }
  return table;
}

}  // namespace filiform::internal
