#include "index/input/internal/read_ahead.h"

#include <chrono>
#include <system_error>
#include <utility>

namespace filiform::internal {
namespace {

constexpr std::size_t kInputsOfThread = 4;                     // under way at a time
constexpr std::size_t kSamplesOfSpare = std::size_t{1} << 14;  // larger arrays are freed
constexpr std::chrono::milliseconds kReadAheadWait{100};

}  // namespace

ReadAhead::ReadAhead(Plan plan) : plan_(std::move(plan)) {}

ReadAhead::~ReadAhead() {
  {
    const std::lock_guard lock(mutex_);
    ended_ = true;
    stop_ = true;
  }
  room_.notify_all();
}

void ReadAhead::startThreads() {
  try {
    for (unsigned reader = static_cast<unsigned>(threads_.size()) + 1; reader < plan_.threads; ++reader)
      threads_.emplace_back([this, reader] { work(reader); });
  } catch (const std::system_error&) {
    // The threads already started, and the calling one, do the work.
  }
}

void ReadAhead::work(unsigned reader) {
  std::unique_lock lock(mutex_);
  while (!ended_) {
    if (mayRead())
      readNext(reader, lock);
    else
      room_.wait(lock);
  }
}

bool ReadAhead::mayRead() {
  if (paused_ || slots_.size() >= kInputsOfThread * plan_.threads) return false;
  while (next_ < plan_.costs.size() && plan_.costs[next_] == kSkip) ++next_;
  if (next_ >= plan_.costs.size()) return false;
  const std::uint64_t bytes = plan_.costs[next_];
  return bytes != kAlone && (slots_.empty() || (used_ <= plan_.bytes && bytes <= plan_.bytes - used_));
}

void ReadAhead::readNext(unsigned reader, std::unique_lock<std::mutex>& lock) {
  if (spare_.empty()) spare_.push_back(std::make_unique<Slot>());
  Slot& slot = *slots_.emplace_back(std::move(spare_.back()));
  spare_.pop_back();
  slot.item = next_++;
  slot.bytes = plan_.costs[slot.item];
  slot.done = false;
  used_ += slot.bytes;
  ++busy_;
  lock.unlock();
  try {
    plan_.read(reader, slot.item, stop_, slot.result);
  } catch (...) {
    slot.result.failure = std::current_exception();
  }
  lock.lock();
  slot.done = true;
  --busy_;
  done_.notify_one();
}

void ReadAhead::take(std::size_t item, Result& result, const std::function<void()>& wait) {
  std::unique_lock lock(mutex_);
  if (!slots_.empty() && slots_.front()->item != item) discard(lock);
  if (slots_.empty()) next_ = item;
  if (std::exchange(paused_, false)) startThreads();
  room_.notify_all();
  while (slots_.empty() || !slots_.front()->done) {
    if (mayRead()) {
      readNext(0, lock);
    } else if (done_.wait_for(lock, kReadAheadWait) == std::cv_status::timeout) {
      lock.unlock();
      wait();
      lock.lock();
    }
  }
  std::unique_ptr<Slot> slot = std::move(slots_.front());
  slots_.pop_front();
  used_ -= slot->bytes;
  std::swap(result, slot->result);
  recycle(std::move(slot));
  room_.notify_all();
}

void ReadAhead::recycle(std::unique_ptr<Slot> slot) {
  slot->result.report = {};
  slot->result.bytes = 0;
  slot->result.failure = nullptr;
  if (slot->result.cell.sample_ids.capacity() > kSamplesOfSpare) slot->result.cell = {};
  spare_.push_back(std::move(slot));
}

void ReadAhead::discard(std::unique_lock<std::mutex>& lock) {
  paused_ = true;
  stop_ = true;
  done_.wait(lock, [&] { return busy_ == 0; });
  stop_ = false;
  while (!slots_.empty()) {
    recycle(std::move(slots_.front()));
    slots_.pop_front();
  }
  used_ = 0;
}

}  // namespace filiform::internal
