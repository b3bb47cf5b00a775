// The part of TileLoader that reads lists of tiles: those of cells, and pages of the directory.
#include "index/streaming/internal/tile_loader.h"

#include <algorithm>
#include <exception>
#include <limits>
#include <utility>

namespace filiform::internal {
namespace {

constexpr std::size_t kMaxCells = 8;  // at least; number of cells whose lists of tiles are kept

}  // namespace

std::span<const TileId> TileLoader::tilesOf(std::uint32_t cell) {
  const auto found = cells_.find(cell);
  if (found == cells_.end() || found->second.usable > now_) return {};
  found->second.last_plan = plan_number_;
  return found->second.tiles;
}

std::vector<std::uint32_t> TileLoader::cellsOfReaders() const {
  std::vector<std::uint32_t> cells;
  for (const Peer& p : peers_) {
    if (!p.has_focus || p.focus.is_view) continue;
    if (p.focus.active_tile != kNoTile) cells.push_back(p.focus.active_node.cell);
    if (p.focus.target_tile != kNoTile) cells.push_back(p.focus.target_node.cell);
  }
  return cells;
}

bool TileLoader::fetchCells(double due, std::unique_lock<std::mutex>& lock) {
  if (options_.prefetch != PrefetchPolicy::structure) return false;
  for (const std::uint32_t cell : cellsOfReaders()) {
    const auto known = cells_.find(cell);
    if (known != cells_.end() && !(known->second.retry <= now_)) continue;
    const double backoff =
        known == cells_.end() ? pace_.first_retry : std::min(2 * known->second.backoff, pace_.last_retry);
    if (known == cells_.end() && cells_.size() >= std::max(kMaxCells, 2 * peers_.size()))
      cells_.erase(std::min_element(cells_.begin(), cells_.end(), [](const auto& a, const auto& b) {
        return a.second.last_plan < b.second.last_plan;
      }));
    constexpr double kNever = std::numeric_limits<double>::infinity();
    cells_[cell] = {{}, kNever, kNever, backoff, plan_number_};
    std::vector<TileId> tiles;
    std::string reason;
    leaves_();
    lock.unlock();
    try {
      if (cell < store_.cell_count()) tiles = store_.cellTiles(cell);
    } catch (const std::exception& error) {
      reason = error.what();
    }
    lock.lock();
    // Without its list, a cell is followed only through tiles in memory.
    if (!reason.empty()) {
      failed_cells_[cell] = "cell " + std::to_string(cell) + ": " + reason;
      ++counters_.failures;
      cells_[cell] = {{}, kNever, now_ + backoff, backoff, plan_number_};
    } else {
      failed_cells_.erase(cell);
      cells_[cell] = {std::move(tiles), due, kNever, backoff, plan_number_};
      cells_due_ = std::min(cells_due_, due);
    }
    return true;
  }
  return false;
}

bool TileLoader::readPage(std::unique_lock<std::mutex>& lock) {
  const auto& noted = pages_.noted();
  auto best = noted.end();
  for (auto at = noted.begin(); at != noted.end(); ++at) {
    const auto failed = failed_pages_.find(at->first);
    if (failed != failed_pages_.end() && failed->second.retry > now_) continue;
    if (best != noted.end() && best->second <= at->second) continue;
    if (std::find(pages_read_now_.begin(), pages_read_now_.end(), at->first) == pages_read_now_.end()) best = at;
  }
  if (best == noted.end()) return false;
  const std::uint32_t page = best->first;
  pages_read_now_.push_back(page);
  leaves_();
  lock.unlock();
  std::string reason;
  try {
    store_.entry(pages_.firstTile(page));
  } catch (const std::exception& error) {
    reason = error.what();
  }
  lock.lock();
  std::erase(pages_read_now_, page);
  if (!reason.empty()) {
    FailedPage& failed = failed_pages_[page];
    failed.backoff = failed.backoff > 0 ? std::min(2 * failed.backoff, pace_.last_retry) : pace_.first_retry;
    failed.retry = now_ + failed.backoff;
    failed.line = reason;
    ++counters_.failures;
    return true;
  }
  failed_pages_.erase(page);
  pages_.add(page);
  for (Peer& p : peers_) p.walk_stale = p.around_stale = true;
  stale_ = urgent_ = true;
  return true;
}

}  // namespace filiform::internal
