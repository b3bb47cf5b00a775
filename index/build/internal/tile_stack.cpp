#include "index/build/internal/tile_stack.h"

#include "index/set/internal/tile_entry.h"
#include "index/tile/internal/path_thinner.h"
#include "index/tile/tile_codec.h"

#include <algorithm>
#include <utility>

namespace filiform::internal {

TileStack::TileStack(const Grid& grid, unsigned workers, const std::string& folder, std::uint64_t memory,
                     std::vector<float> tolerances_um)
    : grid_(grid), tolerances_um_(std::move(tolerances_um)), spool_(folder, kBlockBytes, memory) {
  for (unsigned i = 0; i < workers; ++i) heaps_.push_back({ByteChain(spool_), {}});
}

void TileStack::add(unsigned worker, LeafUnit& unit) {
  Heap& heap = heaps_[worker];
  TileAppearance appearance;
  for (std::size_t i = 0; i < unit.keys.size(); ++i) {
    if (unit.of(i).empty()) continue;
    std::vector<StoredSegment> segments;
    unit.content(i, segments, appearance);
    if (unit.keys.size() == 1 && unit.records.size() > LeafUnit::kRecordsKept) unit.records = {};
    const std::uint32_t leaf = unit.first + static_cast<std::uint32_t>(i);
    std::vector<std::uint8_t> neurites;
    std::uint32_t points = 0;
    if (leaf < tolerances_um_.size()) {
      const Neurites thin = thinned(segments, appearance, grid_, static_cast<double>(tolerances_um_[leaf]));
      points = static_cast<std::uint32_t>(thin.points.size());
      neurites = packed(thin);
    }
    const Tile tile(0, unit.keys[i], unit.is_long, grid_, std::move(segments));
    const std::vector<std::uint8_t> geometry = encodeTile(tile), look = encodeAppearance(appearance);
    heap.tiles.push_back(
        {entryOf(tile), leaf, worker, heap.bytes.bytes(), points, geometry.size(), look.size(), neurites.size()});
    heap.bytes.append(geometry);
    heap.bytes.append(look);
    heap.bytes.append(neurites);
  }
}

std::vector<TileStack::Encoded> TileStack::finish() {
  std::vector<Encoded> all;
  std::size_t size = 0;
  for (const Heap& heap : heaps_) size += heap.tiles.size();
  all.reserve(size);
  for (Heap& heap : heaps_) {
    heap.bytes.close();
    all.insert(all.end(), heap.tiles.begin(), heap.tiles.end());
    heap.tiles = {};
  }
  std::sort(all.begin(), all.end(), [](const Encoded& a, const Encoded& b) { return a.leaf < b.leaf; });
  return all;
}

void TileStack::write(TileId id, const Encoded& tile, TileWriter& writer) {
  bytes_.resize(tile.geometry_bytes + tile.appearance_bytes);
  heaps_[tile.heap].bytes.read(tile.offset, bytes_, scratch_);
  const std::span<const std::uint8_t> all(bytes_);
  writer.add(id, tile.entry, all.first(tile.geometry_bytes), all.subspan(tile.geometry_bytes));
}

Neurites TileStack::neurites(const Encoded& tile) const {
  Spool::Buffer scratch;
  std::vector<std::uint8_t> bytes(tile.neurite_bytes);
  heaps_[tile.heap].bytes.read(tile.offset + tile.geometry_bytes + tile.appearance_bytes, bytes, scratch);
  return unpacked(bytes);
}

}  // namespace filiform::internal
