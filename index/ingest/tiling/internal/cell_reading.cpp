#include "index/ingest/tiling/internal/cell_reading.h"

#include "index/errors.h"
#include "index/workers.h"

#include <algorithm>
#include <atomic>
#include <condition_variable>
#include <deque>
#include <map>
#include <mutex>
#include <optional>
#include <utility>
#include <vector>

namespace filiform::internal {
namespace {

constexpr std::uint32_t kCellsBetweenChecks = 256;
constexpr std::size_t kWaitingOfThread = 2;

struct NumberedCell {
  Cell cell;
  std::uint32_t id;
};

// Cells on their way from the reader to the other threads. Thread rule: internally synchronised.
class Queue {
 public:
  explicit Queue(std::size_t most) : most_(most) {}

  // Takes the cell, and replaces it by one whose memory can be used again. Returns false if too many wait.
  bool offer(Cell& cell, std::uint32_t id) {
    {
      const std::lock_guard lock(mutex_);
      if (cells_.size() >= most_) return false;
      cells_.push_back({std::move(cell), id});
      cell = {};
      if (!used_.empty()) {
        cell = std::move(used_.back());
        used_.pop_back();
      }
    }
    changed_.notify_one();
    return true;
  }
  // Waits for a cell; none: no more will come.
  std::optional<NumberedCell> next() {
    std::unique_lock lock(mutex_);
    changed_.wait(lock, [this] { return ended_ || !cells_.empty(); });
    if (cells_.empty()) return std::nullopt;
    NumberedCell cell = std::move(cells_.front());
    cells_.pop_front();
    return cell;
  }
  void giveBack(Cell cell) {
    const std::lock_guard lock(mutex_);
    used_.push_back(std::move(cell));
  }
  void end() {
    {
      const std::lock_guard lock(mutex_);
      ended_ = true;
    }
    changed_.notify_all();
  }

 private:
  std::mutex mutex_;
  std::condition_variable changed_;
  const std::size_t most_;
  std::deque<NumberedCell> cells_;
  std::vector<Cell> used_;
  bool ended_ = false;
};

// Puts what the threads found into the order of cells. Thread rule: internally synchronised.
class InOrder {
 public:
  explicit InOrder(CellIntake& intake) : intake_(intake) {}

  void keep(std::uint32_t id, TakenCell cell) {
    const std::lock_guard lock(mutex_);
    waiting_.emplace(id, std::move(cell));
    for (; !waiting_.empty() && waiting_.begin()->first == next_; ++next_) {
      intake_.take(std::move(waiting_.begin()->second));
      waiting_.erase(waiting_.begin());
    }
    segments_ = intake_.segments();
  }
  std::uint64_t segments() const { return segments_; }
  template <typename Use>
  void whileKept(const Use& use) {
    const std::lock_guard lock(mutex_);
    use();
  }

 private:
  std::mutex mutex_;
  CellIntake& intake_;
  std::map<std::uint32_t, TakenCell> waiting_;
  std::uint32_t next_ = 0;
  std::atomic<std::uint64_t> segments_{0};
};

struct ReadingWorker {
  ReadingWorker(const CellReading& reading, Spool& spool)
      : chunks(spool, reading.most_in_chunk, std::max(Chunks::kLeastOpen, reading.most_open / reading.threads)),
        work(reading.grid, chunks) {}

  void take(Cell& cell, std::uint32_t id, InOrder& kept) {
    kept.keep(id, work.take(cell, id));
    blocks = chunks.size();
  }

  Chunks chunks;
  CellWork work;
  std::atomic<std::size_t> blocks{0};
};

}  // namespace

void readCells(CellStream& stream, const CellReading& reading, Spool& spool, CellIntake& intake, Chunks& chunks,
               LandmarkSurvey& survey) {
  std::deque<ReadingWorker> workers;
  for (unsigned i = 0; i < reading.threads; ++i) workers.emplace_back(reading, spool);
  Queue queue(kWaitingOfThread * (reading.threads - 1));
  InOrder kept(intake);
  const auto readAll = [&](const std::atomic<bool>& failed) {
    Cell cell;
    for (std::uint32_t id = 0; !failed; ++id) {
      reading.progress(kept.segments());
      if (!stream.next(cell)) break;
      if (id == kMostCells) throw InputError("more than 2^32 - 2 cells: split the input into several sets");
      if (cell.samples() > Cell::kSamplesKept || !queue.offer(cell, id)) {
        workers[0].take(cell, id, kept);
        cell.discardLarge();
      }
      if ((id + 1) % kCellsBetweenChecks != 0) continue;
      std::size_t blocks = 0;
      for (const ReadingWorker& worker : workers) blocks += worker.blocks;
      kept.whileKept([&] { reading.check(blocks); });
    }
  };
  runWorkers(reading.threads, [&](unsigned worker, const std::atomic<bool>& failed) {
    if (worker == 0) {
      struct End {
        Queue& queue;
        ~End() { queue.end(); }
      } const end{queue};
      readAll(failed);
    }
    while (!failed) {
      std::optional<NumberedCell> one = queue.next();
      if (!one) break;
      workers[worker].take(one->cell, one->id, kept);
      queue.giveBack(std::move(one->cell));
    }
  });
  for (ReadingWorker& worker : workers) {
    chunks.take(worker.chunks);
    survey.add(worker.work.survey());
  }
}

}  // namespace filiform::internal
