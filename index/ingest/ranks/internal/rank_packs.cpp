#include "index/ingest/ranks/internal/rank_packs.h"

#include "index/file/internal/digest.h"
#include "index/ingest/ranks/internal/rank_streams.h"
#include "index/set/internal/pack_writer.h"

#include <utility>
#include <vector>

namespace filiform::internal {
namespace {

constexpr std::size_t kBlockBytes = std::size_t{64} << 10;
constexpr const char* kTooLarge = "a tile takes more than 4 GiB: too many segments have the same midpoint";

// Where every tile of every rank goes.
class Layout {
 public:
  // As PackWriter orders tiles of these sizes.
  Layout(Ranks& ranks, const std::vector<std::uint64_t>& own_sizes, std::uint64_t pack_bytes) {
    ByteWriter mine;
    for (const std::uint64_t size : own_sizes) mine.varint(size);
    std::uint64_t end = 0;  // of the pack
    std::uint32_t packs = 0;
    for (const Bytes& bytes : ranks.share(mine.bytes())) {
      first_.push_back(tiles_.size());
      for (ByteReader in(bytes); in.left() > 0;) {
        const std::uint64_t size = in.varint();
        if (packs == 0 || end + size > pack_bytes) {
          ++packs;
          end = kPackHeaderBytes;
          owner_.push_back(static_cast<unsigned>(first_.size() - 1));
        }
        tiles_.push_back({packs - 1, end, size});
        end += size;
      }
    }
    first_.push_back(tiles_.size());
  }
  struct Tile {
    std::uint32_t pack;
    std::uint64_t offset, size;
  };
  const std::vector<Tile>& tiles() const { return tiles_; }
  std::size_t first(unsigned rank) const { return first_[rank]; }
  std::size_t end(unsigned rank) const { return first_[rank + 1]; }
  unsigned owner(std::size_t tile) const { return owner_[tiles_[tile].pack]; }

 private:
  std::vector<Tile> tiles_;
  std::vector<std::size_t> first_;  // by rank
  std::vector<unsigned> owner_;     // by pack: the rank of its first tile
};

// Reads values that another rank has sent.
class Stream {
 public:
  explicit Stream(ByteChain& chain) : reader_(chain, true) {}
  Bytes bytes(std::size_t n) {
    Bytes read(n);
    reader_.read(read.data(), n);
    return read;
  }
  std::uint64_t u64() {
    const Bytes read = bytes(sizeof(std::uint64_t));
    return ByteReader(read).u64();
  }

 private:
  ByteChain::Reader reader_;
};

void appendWithSize(ByteChain& chain, const Bytes& bytes) {
  ByteWriter size;
  size.u64(bytes.size());
  chain.append(size.bytes());
  chain.append(bytes);
}

Bytes encoded(const TileEntry& entry, std::uint32_t leaf, const TileLocation& at) {
  ByteWriter out;
  out.key(entry.key.low);
  out.u32(static_cast<std::uint32_t>(entry.key.depth));
  out.box(entry.content);
  for (const std::uint32_t count : {entry.owned, entry.stored, entry.isolated}) out.u32(count);
  out.u64(entry.decoded_bytes);
  out.u8(entry.types);
  out.u32(leaf);
  out.u32(at.pack);
  out.u32(at.geometry_bytes);
  out.u32(at.appearance_bytes);
  out.u64(at.offset);
  out.u64(at.geometry_checksum);
  out.u64(at.appearance_checksum);
  return out.take();
}

struct Placed {
  TileEntry entry;
  std::uint32_t leaf = 0;
  TileLocation at;
};

Placed decodedTile(const Bytes& bytes) {
  ByteReader in(bytes);
  Placed tile;
  tile.entry.key.low = in.key();
  tile.entry.key.depth = static_cast<int>(in.u32());
  tile.entry.content = in.box();
  for (std::uint32_t* const count : {&tile.entry.owned, &tile.entry.stored, &tile.entry.isolated}) *count = in.u32();
  tile.entry.decoded_bytes = in.u64();
  tile.entry.types = in.u8();
  tile.leaf = in.u32();
  tile.at.pack = in.u32();
  tile.at.geometry_bytes = in.u32();
  tile.at.appearance_bytes = in.u32();
  tile.at.offset = in.u64();
  tile.at.geometry_checksum = in.u64();
  tile.at.appearance_checksum = in.u64();
  return tile;
}

// Exchanges the tiles whose packs other ranks write. Calls `use` for each that arrives, in order.
void passTiles(const RankPacks& packs, const Layout& layout, std::vector<ByteChain>& outgoing, Spool& spool,
               const std::function<void(const Bytes& tile)>& use) {
  std::vector<ByteChain> arrived = exchangeBytes(packs.ranks, outgoing, spool);
  for (unsigned from = packs.ranks.rank() + 1; from < packs.ranks.count(); ++from) {
    Stream stream(arrived[from]);
    for (std::size_t tile = layout.first(from); tile < layout.end(from); ++tile)
      if (layout.owner(tile) == packs.ranks.rank()) use(stream.bytes(layout.tiles()[tile].size));
  }
}

}  // namespace

void packTogether(const RankPacks& packs, TileWriter& writer) {
  Spool spool(packs.folder, kBlockBytes, packs.memory);
  std::vector<std::uint64_t> sizes;
  for (TileId tile = 0; tile < writer.tiles(); ++tile) {
    const TileLocation& at = writer.location(tile);
    sizes.push_back(std::uint64_t{at.geometry_bytes} + at.appearance_bytes);
  }
  const Layout layout(packs.ranks, sizes, packs.pack_bytes);
  std::vector<ByteChain> outgoing = chainsForRanks(packs.ranks, spool);
  passTiles(packs, layout, outgoing, spool, [&](const Bytes& tile) { writer.append(tile, {}); });
  std::vector<ByteChain> arrived = exchangeBytes(packs.ranks, outgoing, spool);
  for (unsigned from = 1; from < packs.ranks.count(); ++from) {
    Stream stream(arrived[from]);
    for (std::size_t n = layout.end(from) - layout.first(from); n > 0; --n) {
      const Placed tile = decodedTile(stream.bytes(stream.u64()));
      writer.addPlaced(tile.entry, tile.at, tile.leaf == packs.leaves);
      std::uint64_t points = 0;
      Bytes neurites;
      if (packs.neurites) {
        points = stream.u64();
        neurites = stream.bytes(stream.u64());
      }
      packs.packer.take(tile.leaf, static_cast<std::uint32_t>(points), neurites);
    }
    for (std::uint64_t files = stream.u64(); files > 0; --files) {
      const Bytes name = stream.bytes(stream.u64());
      const std::uint64_t bytes = stream.u64();
      writer.refer({std::string(name.begin(), name.end()), bytes, stream.u64()});
    }
  }
}

struct RankPacker::Impl {
  explicit Impl(const RankPacks& given)
      : packs(given),
        spool(packs.folder, kBlockBytes, packs.memory),
        layout(packs.ranks, packs.packer.heldSizes(), packs.pack_bytes),
        next(layout.first(packs.ranks.rank())),
        outgoing(chainsForRanks(packs.ranks, spool)),
        table(chainsForRanks(packs.ranks, spool)),
        files(packs.folder, {packFile, [](std::uint32_t pack) { return packHeader(pack); }}, packs.pack_bytes) {
    for (std::size_t tile = next; tile < layout.end(packs.ranks.rank()); ++tile)
      if (layout.owner(tile) == packs.ranks.rank()) {
        files.numberFrom(layout.tiles()[tile].pack);
        break;
      }
  }

  RankPacks packs;
  Spool spool;
  Layout layout;
  std::size_t next;                 // tile
  TileId own = 0;                   // among those of this rank
  std::vector<ByteChain> outgoing;  // tiles for the packs of other ranks
  std::vector<ByteChain> table;     // for rank 0: entries, neurites and files
  PackWriter files;
};

RankPacker::RankPacker(const RankPacks& packs) : impl_(std::make_unique<Impl>(packs)) {}
RankPacker::~RankPacker() = default;

void RankPacker::add(const TileEntry& entry, std::uint32_t leaf, ByteSpan geometry, ByteSpan appearance) {
  Impl& i = *impl_;
  TileLocation at;
  if (const unsigned owner = i.layout.owner(i.next); owner == i.packs.ranks.rank()) {
    at = i.files.add(geometry, appearance, kTooLarge);
  } else {
    at.pack = i.layout.tiles()[i.next].pack;
    at.offset = i.layout.tiles()[i.next].offset;
    at.geometry_bytes = static_cast<std::uint32_t>(geometry.size());
    at.appearance_bytes = static_cast<std::uint32_t>(appearance.size());
    at.geometry_checksum = checksum(geometry);
    at.appearance_checksum = checksum(appearance);
    i.outgoing[owner].append(geometry);
    i.outgoing[owner].append(appearance);
  }
  ++i.next;
  appendWithSize(i.table[0], encoded(entry, leaf, at));
  if (!i.packs.neurites) return;
  ByteWriter points;
  points.u64(i.packs.packer.neurite_points(i.own));
  i.table[0].append(points.bytes());
  appendWithSize(i.table[0], i.packs.packer.packedNeurites(i.own));
  ++i.own;
}

void RankPacker::run() {
  Impl& i = *impl_;
  i.packs.packer.closeNeurites();
  i.packs.packer.passHeld();
  passTiles(i.packs, i.layout, i.outgoing, i.spool, [&i](const Bytes& tile) { i.files.add(tile, {}, kTooLarge); });
  const std::vector<SetFile> made = i.files.close();
  ByteWriter out;
  out.u64(made.size());
  for (const SetFile& file : made) {
    out.u64(file.name.size());
    out.text(file.name);
    out.u64(file.bytes);
    out.u64(file.digest);
  }
  i.table[0].append(out.bytes());
  exchangeBytes(i.packs.ranks, i.table, i.spool);
}

}  // namespace filiform::internal
