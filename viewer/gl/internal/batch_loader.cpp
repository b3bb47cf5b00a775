#include "viewer/gl/internal/batch_loader.h"

#include "index/file/future_read.h"
#include "index/set/reads_at_once.h"

#include <algorithm>
#include <chrono>
#include <condition_variable>
#include <deque>
#include <future>
#include <map>
#include <mutex>
#include <set>
#include <sys/resource.h>
#include <thread>

namespace filiform::internal {

namespace {

// Most batches that wait to be taken. More would only hold memory while the camera moves on.
constexpr std::size_t kMostReady = 64;
// From a set at an address, the tiles of this many jobs are read at once.
constexpr std::size_t kReadAhead = 16;

// Segments of a block of a cell: the eye may be inside the cell, and segments of the eye's own blocks are cones.
constexpr std::size_t kCellBlock = 256;

struct ReadTile {
  std::shared_ptr<const Tile> tile;
  TileAppearance appearance;
};

bool isSame(const TileJob& a, const TileJob& b) {
  return a.key == b.key && a.whole_cell == b.whole_cell && a.only_below == b.only_below;
}

}  // namespace

struct BatchLoader::Impl {
  const TileStore& store;
  const Levels* levels;

  mutable std::mutex mutex;
  std::condition_variable to_do, done;
  std::vector<TileJob> jobs;  // the next one last
  std::deque<LoadedTile> ready;
  bool busy = false, stop = false;
  TileJob under_way;

  // Details of cells for the loading thread, read once each by the threads that read tiles.
  mutable std::mutex details_mutex;
  mutable std::map<std::uint32_t, std::shared_future<CellDetail>> details{};  // read, or being read
  mutable std::set<std::uint32_t> cells_known{};                              // learnt by the loading thread

  // Used by the loading thread only:
  RootTable roots;
  SomaFinder finder;
  mutable ReadThreads threads{mostReadThreads()};  // with the priority of the loading thread
  struct Ahead {
    TileJob job;
    FutureRead<ReadTile> read;
  };
  std::deque<Ahead> ahead{};  // tiles of the next jobs
  std::thread thread{};

  void run();
  void learn(std::uint32_t cell, const CellDetail& detail);
  void learnCellsOf(const Tile& tile);
  // Reads the details of the cells that have open nodes in a tile, unless another thread has begun to.
  void readCellsOf(const Tile& tile) const;
  NeuriteBatch load(const TileJob& job);
  ReadTile read(const TileJob& job) const;
  // Begins to read the tiles of the next jobs, given with the mutex held. Forgets those that are no longer wanted.
  void readAhead();
  // The tile of a job, from `ahead` if it is there.
  ReadTile take(const TileJob& job);
  bool isKnown(const TileJob& job) const {
    return (busy && isSame(under_way, job)) ||
           std::any_of(ready.begin(), ready.end(), [&](const LoadedTile& tile) { return isSame(tile.job, job); });
  }
};

void BatchLoader::Impl::learn(std::uint32_t cell, const CellDetail& detail) {
  for (const CellDetail::Root& root : detail.roots) roots[{cell, root.rank}] = root;
  finder.offer(cell, detail);
  const std::lock_guard lock(details_mutex);
  cells_known.insert(cell);
  details.erase(cell);
}

void BatchLoader::Impl::learnCellsOf(const Tile& tile) {
  for (const std::uint32_t cell : cellsWithOpenNodes(tile)) {
    std::shared_future<CellDetail> detail;
    {
      const std::lock_guard lock(details_mutex);
      if (cells_known.contains(cell)) continue;
      if (const auto found = details.find(cell); found != details.end()) detail = found->second;
    }
    learn(cell, detail.valid() ? detail.get() : store.loadCellDetail(cell));
  }
}

void BatchLoader::Impl::readCellsOf(const Tile& tile) const {
  for (const std::uint32_t cell : cellsWithOpenNodes(tile)) {
    std::promise<CellDetail> detail;
    {
      const std::lock_guard lock(details_mutex);
      if (cells_known.contains(cell) || !details.try_emplace(cell, detail.get_future().share()).second) continue;
    }
    try {
      detail.set_value(store.loadCellDetail(cell));
    } catch (...) {
      const std::lock_guard lock(details_mutex);
      details.erase(cell);  // the next tile with this cell tries again
      detail.set_exception(std::current_exception());
    }
  }
}

ReadTile BatchLoader::Impl::read(const TileJob& job) const {
  if (job.only_below) {
    levels->below(job.tile);
    return {};
  }
  // Both parts lie side by side in the file; from far away they come at the same time.
  FutureRead<TileAppearance> appearance(store.isRemote() ? &threads : nullptr, [&] {
    return job.level ? levels->loadAppearance(job.tile) : store.loadAppearance(job.tile);
  });
  ReadTile both;
  both.tile = job.level ? levels->load(job.tile) : store.load(job.tile);
  both.appearance = appearance.get();
  if (!job.level) readCellsOf(*both.tile);
  return both;
}

void BatchLoader::Impl::readAhead() {
  if (!store.isRemote()) return;
  const std::size_t most = std::min<std::size_t>(kReadAhead, readsAtOnce(store)), count = std::min(jobs.size(), most);
  const auto next = [&](std::size_t i) -> const TileJob& { return jobs[jobs.size() - 1 - i]; };
  const auto isWanted = [&](const Ahead& a) {
    if (busy && isSame(a.job, under_way)) return true;
    for (std::size_t i = 0; i < count; ++i)
      if (isSame(a.job, next(i))) return true;
    return false;
  };
  // A read under way is kept: forgetting it would wait for it.
  std::erase_if(ahead, [&](Ahead& a) { return !isWanted(a) && a.read.giveUp(); });
  for (std::size_t i = 0; i < count && ahead.size() < 2 * most; ++i) {
    const TileJob job = next(i);
    if (job.whole_cell != UINT32_MAX) continue;
    if (std::any_of(ahead.begin(), ahead.end(), [&](const Ahead& a) { return isSame(a.job, job); })) continue;
    ahead.push_back({job, FutureRead<ReadTile>(&threads, [this, job] { return read(job); })});
  }
}

ReadTile BatchLoader::Impl::take(const TileJob& job) {
  const auto found = std::find_if(ahead.begin(), ahead.end(), [&](const Ahead& a) { return isSame(a.job, job); });
  if (found == ahead.end()) return read(job);
  FutureRead<ReadTile> read = std::move(found->read);
  ahead.erase(found);
  return read.get();
}

NeuriteBatch BatchLoader::Impl::load(const TileJob& job) {
  BatchOptions options;
  NeuriteBatch batch;
  if (job.whole_cell != UINT32_MAX) {
    const CellDetail detail = store.loadCellDetail(job.whole_cell);
    learn(job.whole_cell, detail);
    options.roots = &roots;
    options.only_cell = job.whole_cell;
    for (const TileId id : detail.tiles) {
      const std::shared_ptr<const Tile> tile = store.load(id);
      const TileAppearance appearance = store.loadAppearance(id);
      finder.offer(tile, appearance);
      const SomaTable somata = somataIn(*tile, appearance, roots, finder);
      options.somata = &somata;
      append(batch, makeBatch(*tile, appearance, options));
    }
  } else if (job.only_below) {
    take(job);
  } else {
    const auto [tile, appearance] = take(job);
    if (!job.level) learnCellsOf(*tile);
    options.roots = job.level ? nullptr : &roots;
    if (!job.level) finder.offer(tile, appearance);
    // Level tiles hold somata as balls.
    const SomaTable somata = job.level ? SomaTable() : somataIn(*tile, appearance, roots, finder);
    options.somata = &somata;
    batch = makeBatch(*tile, appearance, options);
    if (job.level) batch.pixel_um = levels->entry(job.tile).pixel_um;
  }
  if (job.level) cutIntoBlocks(batch);
  if (job.whole_cell != UINT32_MAX) cutIntoBlocks(batch, kCellBlock);
  sortForDrawing(batch);
  return batch;
}

void BatchLoader::Impl::run() {
  // Frames go first where cores are few. (On Linux each thread has its own niceness.)
  ::setpriority(PRIO_PROCESS, 0, 10);
  std::unique_lock lock(mutex);
  for (;;) {
    to_do.wait(lock, [this] { return stop || (!jobs.empty() && ready.size() < kMostReady); });
    if (stop) return;
    under_way = jobs.back();
    jobs.pop_back();
    busy = true;
    readAhead();
    lock.unlock();
    LoadedTile loaded{under_way, {}, nullptr};
    try {
      loaded.batch = load(loaded.job);
    } catch (...) {
      loaded.error = std::current_exception();
    }
    lock.lock();
    busy = false;
    ready.push_back(std::move(loaded));
    done.notify_all();
  }
}

BatchLoader::BatchLoader(const TileStore& store, const Levels* levels)
    : impl_(new Impl{.store = store,
                     .levels = levels,
                     .mutex = {},
                     .to_do = {},
                     .done = {},
                     .jobs = {},
                     .ready = {},
                     .under_way = {},
                     .details_mutex = {},
                     .roots = {},
                     .finder = SomaFinder(store)}) {
  impl_->thread = std::thread([this] { impl_->run(); });
}

BatchLoader::~BatchLoader() {
  stop();
  impl_->thread.join();
}

void BatchLoader::stop() {
  {
    const std::lock_guard lock(impl_->mutex);
    impl_->stop = true;
  }
  impl_->to_do.notify_all();
}

void BatchLoader::want(std::vector<TileJob> jobs) {
  const std::lock_guard lock(impl_->mutex);
  std::erase_if(jobs, [this](const TileJob& job) { return impl_->isKnown(job); });
  std::reverse(jobs.begin(), jobs.end());
  impl_->jobs = std::move(jobs);
  impl_->to_do.notify_all();
}

bool BatchLoader::take(LoadedTile& tile) {
  const std::lock_guard lock(impl_->mutex);
  if (impl_->ready.empty()) return false;
  tile = std::move(impl_->ready.front());
  impl_->ready.pop_front();
  impl_->to_do.notify_all();
  return true;
}

bool BatchLoader::isIdle() const {
  const std::lock_guard lock(impl_->mutex);
  return impl_->jobs.empty() && !impl_->busy && impl_->ready.empty();
}

bool BatchLoader::wait(double most_s) {
  std::unique_lock lock(impl_->mutex);
  const auto isOver = [this] { return !impl_->ready.empty() || (impl_->jobs.empty() && !impl_->busy); };
  impl_->done.wait_for(lock, std::chrono::duration<double>(most_s), isOver);
  return !impl_->ready.empty();
}

}  // namespace filiform::internal
