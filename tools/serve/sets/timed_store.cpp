#include "tools/serve/sets/timed_store.h"

#include "index/errors.h"
#include "tools/words/refusal.h"

#include <chrono>
#include <optional>

namespace filiform::tools {

namespace {

thread_local std::optional<std::chrono::steady_clock::time_point> answer_deadline;
thread_local double answer_time_s = 0;
thread_local const std::atomic<bool>* answer_left = nullptr;

}  // namespace

TimedStore::Limit::Limit(double seconds, const std::atomic<bool>* left) {
  answer_left = left;
  answer_time_s = seconds;
  answer_deadline = std::chrono::steady_clock::now() + std::chrono::duration_cast<std::chrono::steady_clock::duration>(
                                                           std::chrono::duration<double>(seconds));
}

TimedStore::Limit::~Limit() {
  answer_deadline.reset();
  answer_left = nullptr;
}

bool TimedStore::isOver(double share) {
  const std::chrono::duration<double> rest((1 - share) * answer_time_s);
  return (answer_left != nullptr && *answer_left) ||
         (answer_deadline && std::chrono::steady_clock::now() + rest >= *answer_deadline);
}

void TimedStore::check() {
  if (isOver()) throw AnswerTimeout();
}

template <typename Read>
auto TimedStore::timed(Read read) const {
  check();
  try {
    return read();
  } catch (const CorruptTile&) {
    ++damaged_;
    throw;
  }
}

std::shared_ptr<const Tile> TimedStore::load(TileId tile) const {
  return timed([&] { return store_.load(tile); });
}

TileAppearance TimedStore::loadAppearance(TileId tile) const {
  return timed([&] { return store_.loadAppearance(tile); });
}

CellDetail TimedStore::loadCellDetail(std::uint32_t id) const {
  return timed([&] { return store_.loadCellDetail(id); });
}

std::vector<TileId> TimedStore::cellTiles(std::uint32_t id) const {
  return timed([&] { return store_.cellTiles(id); });
}

}  // namespace filiform::tools
