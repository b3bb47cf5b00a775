#include "index/ingest/tiling/internal/tile_packer.h"

#include "index/levels/internal/path_thinner.h"
#include "index/set/internal/tile_entry.h"
#include "index/tile/tile_codec.h"

#include <utility>

namespace filiform::internal {

TilePacker::TilePacker(Options options, Write write)
    : options_(std::move(options)),
      write_(std::move(write)),
      waiting_spool_(options_.folder, kBlockBytes,
                     options_.tolerances_um.empty() ? options_.memory : options_.memory / 4),
      neurites_spool_(options_.folder, kBlockBytes, options_.memory / 4 * 3),
      tile_of_(options_.leaves + std::size_t{1}, kNoTile) {
  for (unsigned i = 0; i < options_.workers; ++i)
    workers_.push_back({0, Range(waiting_spool_), ByteChain(neurites_spool_)});
  if (options_.hold) head_ = kNone;
}

void TilePacker::begin(unsigned worker, std::uint32_t first) { workers_[worker].first = first; }

void TilePacker::add(unsigned worker, LeafContent& content) {
  Worker& work = workers_[worker];
  const TileAppearance& appearance = content.appearance;
  Kept kept{worker, 0, 0, 0};
  if (content.leaf < options_.tolerances_um.size()) {
    const Neurites thin =
        thinned(content.segments, appearance, options_.grid, static_cast<double>(options_.tolerances_um[content.leaf]));
    const std::vector<std::uint8_t> neurites = packed(thin);
    kept = {worker, static_cast<std::uint32_t>(thin.points.size()), work.neurites.bytes(), neurites.size()};
    work.neurites.append(neurites);
  }
  const Tile tile(0, content.key, content.is_long, options_.grid, content.segments);
  const std::vector<std::uint8_t> geometry = encodeTile(tile), look = encodeAppearance(appearance);
  Waiting made{entryOf(tile), content.leaf, kept, geometry.size(), look.size()};
  made.entry.types = content.types;
  if (head_.load(std::memory_order_acquire) == work.first) {
    passAll(work.range);
    pass(made, geometry, look);
    return;
  }
  work.range.tiles.push_back(made);
  work.range.bytes.append(geometry);
  work.range.bytes.append(look);
}

// Either passes on what has come in order, or leaves it to the thread that ends the range before.
void TilePacker::end(unsigned worker, std::uint32_t end) {
  Worker& work = workers_[worker];
  Range range = std::exchange(work.range, Range(waiting_spool_));
  range.end = end;
  std::unique_lock lock(mutex_);
  if (head_ != work.first) {
    range.bytes.close();
    waiting_.emplace(work.first, std::move(range));
    return;
  }
  for (;;) {
    lock.unlock();
    passAll(range);
    lock.lock();
    const auto next = waiting_.find(range.end);
    if (next == waiting_.end()) break;
    range = std::move(next->second);
    waiting_.erase(next);
  }
  head_.store(range.end, std::memory_order_release);
}

void TilePacker::passAll(Range& range) {
  if (range.tiles.empty()) return;
  range.bytes.close();
  Bytes bytes;
  ByteChain::Reader reader(range.bytes, true);
  for (; !range.tiles.empty(); range.tiles.pop_front()) {
    const Waiting& tile = range.tiles.front();
    bytes.resize(tile.geometry_bytes + tile.appearance_bytes);
    reader.read(bytes.data(), bytes.size());
    const ByteSpan all(bytes);
    pass(tile, all.first(tile.geometry_bytes), all.subspan(tile.geometry_bytes));
  }
}

void TilePacker::pass(const Waiting& tile, ByteSpan geometry, ByteSpan appearance) {
  tile_of_[tile.leaf] = next_++;
  if (!options_.tolerances_um.empty()) kept_.push_back(tile.neurites);
  write_(tile.entry, tile.leaf, geometry, appearance);
}

std::vector<std::uint64_t> TilePacker::heldSizes() const {
  std::vector<std::uint64_t> sizes;
  for (const auto& [first, range] : waiting_)
    for (const Waiting& tile : range.tiles) sizes.push_back(tile.geometry_bytes + tile.appearance_bytes);
  return sizes;
}

void TilePacker::passHeld() {
  for (auto& [first, range] : waiting_) passAll(range);
  waiting_.clear();
}

void TilePacker::take(std::uint32_t leaf, std::uint32_t neurite_points, ByteSpan neurites) {
  tile_of_[leaf] = next_++;
  if (options_.tolerances_um.empty()) return;
  ByteChain& kept = workers_.front().neurites;
  kept_.push_back({0, neurite_points, kept.bytes(), neurites.size()});
  kept.append(neurites);
}

void TilePacker::closeNeurites() {
  for (Worker& worker : workers_) worker.neurites.close();
}

Bytes TilePacker::packedNeurites(TileId tile) const {
  Spool::Buffer scratch;
  const Kept& kept = kept_[tile];
  Bytes bytes(kept.bytes);
  workers_[kept.worker].neurites.read(kept.offset, bytes, scratch);
  return bytes;
}

}  // namespace filiform::internal
