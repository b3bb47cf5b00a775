#include "index/set/tile_store.h"

#include <algorithm>
#include <utility>

namespace filiform {

GridBox TileStore::pageContent(std::uint32_t page) const {
  const std::uint64_t begin = std::uint64_t{page} * page_tiles();
  GridBox box;
  for (std::uint64_t tile = begin; tile < std::min<std::uint64_t>(tile_count(), begin + page_tiles()); ++tile)
    box.extend(entry(static_cast<TileId>(tile)).content);
  return box;
}

GridBox TileStore::groupContent(std::uint32_t group) const {
  const std::uint64_t pages = (std::uint64_t{tile_count()} + page_tiles() - 1) / page_tiles();
  GridBox box;
  for (std::uint64_t page = std::uint64_t{group} * group_pages();
       page < std::min(pages, (std::uint64_t{group} + 1) * group_pages()); ++page)
    box.extend(pageContent(static_cast<std::uint32_t>(page)));
  return box;
}

std::uint64_t TileStore::floorBytes() const {
  TileFloor floor;
  for (TileId tile = 0; tile < tile_count(); ++tile) floor.add(entry(tile).decoded_bytes, tile == long_tile());
  return floor.bytes();
}

void TileFloor::add(std::uint64_t bytes, bool is_long) {
  if (is_long) {
    long_ = bytes;
  } else if (bytes > largest_) {
    second_ = std::exchange(largest_, bytes);
  } else {
    second_ = std::max(second_, bytes);
  }
}

std::uint64_t TileStore::segmentCount() const {
  std::uint64_t sum = 0;
  for (std::uint32_t id = 0; id < cell_count(); ++id) sum += cell(id).segments;
  return sum;
}

std::uint64_t TileStore::decodedBytes() const {
  std::uint64_t sum = 0;
  for (TileId tile = 0; tile < tile_count(); ++tile) sum += entry(tile).decoded_bytes;
  return sum;
}

}  // namespace filiform
