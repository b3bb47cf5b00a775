#include "tools/words/sample_ids.h"

#include "index/errors.h"
#include "index/query/cell_graph.h"
#include "index/set/reads_at_once.h"
#include "index/workers.h"

#include <algorithm>
#include <string>
#include <vector>

namespace filiform::tools {

// In a forest, a segment has the rank of its child. A cell with loops has links.
IdRuns childSampleIds(const TileStore& store, std::uint32_t cell) {
  if (!hasLoops(store.cell(cell))) return store.loadCellDetail(cell).sample_ids;
  const CellGraph graph = readCell(store, cell, false);
  std::vector<std::int64_t> ids;
  for (const auto& link : graph.links) ids.push_back(graph.sample_ids[link[0]]);
  return IdRuns(ids);
}

std::int64_t SampleIds::OfCell::of(std::uint32_t segment) const {
  if (segment < ids_.size()) return ids_[segment];
  throw CorruptSet("cell " + std::to_string(cell_) + " of the tile set", 0,
                   "segment does not exist: " + std::to_string(segment));
}

std::shared_ptr<const SampleIds::OfCell> SampleIds::cell(std::uint32_t cell) {
  {
    const std::lock_guard lock(mutex_);
    if (const auto found = kept_.find(cell); found != kept_.end()) {
      order_.splice(order_.begin(), order_, found->second.place);
      return found->second.ids;
    }
  }
  // Reads without the lock: two threads may read the same cell, and one copy is kept.
  const auto ids = std::make_shared<const OfCell>(cell, childSampleIds(store_, cell));
  const std::lock_guard lock(mutex_);
  const auto [at, fresh] = kept_.try_emplace(cell);
  if (!fresh) return at->second.ids;
  order_.push_front(cell);
  at->second = {ids, order_.begin()};
  bytes_ += ids->bytes();
  trim();
  return ids;
}

void SampleIds::setBudget(std::uint64_t budget_bytes) {
  const std::lock_guard lock(mutex_);
  budget_bytes_ = budget_bytes;
  trim();
}

void SampleIds::trim() {
  while (bytes_ > budget_bytes_ && !order_.empty()) {
    const auto last = kept_.find(order_.back());
    bytes_ -= last->second.ids->bytes();
    kept_.erase(last);
    order_.pop_back();
  }
}

void SampleIds::readAhead(std::vector<std::uint32_t> cells) {
  if (!store_.isRemote()) return;
  std::sort(cells.begin(), cells.end());
  cells.erase(std::unique(cells.begin(), cells.end()), cells.end());
  {
    const std::lock_guard lock(mutex_);
    std::erase_if(cells, [&](std::uint32_t one) { return kept_.contains(one); });
  }
  if (cells.size() < 2) return;
  try {
    runItems(cells.size(), 4 * std::size_t{mostReadThreads()}, [&](std::size_t i) { cell(cells[i]); });
  } catch (const Error&) {
  }
}

std::uint64_t SampleIds::bytes() const {
  const std::lock_guard lock(mutex_);
  return bytes_;
}

}  // namespace filiform::tools
