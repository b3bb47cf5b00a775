#include "solver/travel/hand/internal/hand_navigation.h"

#include <algorithm>
#include <iterator>
#include <utility>

namespace filiform::internal {

HandNavigation::HandNavigation(const TileStore& store, HandTiles& tiles, TravelDevice& device,
                               std::unique_ptr<ProxySolver> solver, const NavigationOptions& options)
    : tiles_(tiles),
      device_(device),
      graph_(tiles.table(), store.leaves(), store.grid()),
      navigation_(graph_, std::move(solver), options) {}

const NavigationTick& HandNavigation::solve(const DeviceState& state, double step_s) noexcept {
  const NavigationTick& tick = navigation_.tick(state, step_s);
  last_ = &tick;
  return tick;
}

const NavigationTick& HandNavigation::tick(const DeviceState& state, double step_s) noexcept {
  return writeMarks(solve(state, step_s));
}

const NavigationTick& HandNavigation::tickWithItsTiles(const DeviceState& state, double step_s) {
  return writeMarks(solveWithItsTiles(state, step_s));
}

const NavigationTick& HandNavigation::tickAsRecorded(const DeviceState& state, double step_s) {
  if (device_.replaysMarks()) {
    const RunMarks& recorded = device_.replay()->marks();
    uncertain_ticks_ += (recorded.bits & MarkBits::kMoreAbsent) != 0;
    tiles_.hide({recorded.values.data(), recorded.count});
  }
  const NavigationTick& tick = solveWithItsTiles(state, step_s);
  tiles_.show();
  return writeMarks(tick);
}

// The loop ends, because each repetition has all earlier tiles and at least one more.
const NavigationTick& HandNavigation::solveWithItsTiles(const DeviceState& state, double step_s) {
  const NavigationTick* tick = &solve(state, step_s);
  bool stalled = false;
  while (tick->frontier && loadTilesOf(*tick)) {
    navigation_.undoSolve();
    stalled = true;
    tick = &solve(state, step_s);
  }
  stalls_ += stalled;
  return *tick;
}

// Returns false if no tile can be added to those of the tick.
bool HandNavigation::loadTilesOf(const NavigationTick& tick) {
  const TileList &touched = tick.step.touched, &absent = tick.step.absent;
  wanted_.assign(touched.ids.begin(), touched.ids.begin() + touched.count);
  const std::size_t before = wanted_.size();
  std::copy_if(absent.ids.begin(), absent.ids.begin() + absent.count, std::back_inserter(wanted_),
               [this](TileId tile) { return !tiles_.hides(tile); });
  if (before == wanted_.size()) return false;
  // After an overflow of the list, its missing tiles could be evicted for its others, without end.
  if (touched.overflow && tiles_.mayEvict()) return false;
  return tiles_.loadTogether(wanted_);
}

const NavigationTick& HandNavigation::writeMarks(const NavigationTick& tick) noexcept {
  if (device_.recorder() == nullptr) return tick;
  marks_.bits |= MarkBits::kTicked | step_mark_;
  if (tick.frontier) {
    const TileList& absent = tick.step.absent;
    marks_.count = static_cast<std::uint32_t>(std::min<std::size_t>(absent.count, marks_.values.size()));
    std::copy_n(absent.ids.begin(), marks_.count, marks_.values.begin());
    if (absent.overflow || absent.count > marks_.count) marks_.bits |= MarkBits::kMoreAbsent;
  }
  device_.mark(marks_);
  marks_ = {};
  return tick;
}

void HandNavigation::publish(const ReaderFocus& focus) noexcept {
  TileFocus* const reader = tiles_.focus();
  if (reader == nullptr) return;
  const TileList* const absent = last_ != nullptr ? &last_->step.absent : nullptr;
  for (std::uint32_t i = 0; absent != nullptr && i < absent->count; ++i) reader->request(absent->ids[i]);
  reader->publishFocus(focus);
  waited_for_.store(absent != nullptr && absent->count > 0 ? absent->ids[0] : kNoTile, std::memory_order_relaxed);
}

void HandNavigation::prepare(double free_s) noexcept { navigation_.prepare(free_s); }

bool HandNavigation::waitsForFailedTile() const {
  const TileId tile = waited_for_.load(std::memory_order_relaxed);
  return tile != kNoTile && tiles_.residency()->state(tile) == TileState::failed;
}

}  // namespace filiform::internal
