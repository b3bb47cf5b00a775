#include "tools/c/handle_table.h"

#include "index/errors.h"

#include <pthread.h>
#include <string>
#include <utility>

namespace filiform::c {

namespace {

std::atomic<std::uint32_t> forks{0};  // of this process and those before it

std::string argument(const char* name) { return std::string(name) + ": "; }

}  // namespace

HandleTable& HandleTable::ofProcess() {
  static HandleTable* const table = [] {
    ::pthread_atfork(nullptr, nullptr, [] { forks.fetch_add(1, std::memory_order_relaxed); });
    return new HandleTable;
  }();
  return *table;
}

void* HandleTable::add(HandleKind kind, std::shared_ptr<void> object) {
  const std::lock_guard lock(mutex_);
  if (free_.empty()) {
    if (slots_ == kChunks * kSlotsOfChunk) throw IoError("filiform", "a million handles are open; close some");
    free_.reserve(std::size_t{slots_} + kSlotsOfChunk);  // leave() then needs no memory
    chunks_[slots_ / kSlotsOfChunk].store(new Slot[kSlotsOfChunk]);
    for (std::uint32_t i = kSlotsOfChunk; i-- > 0;) free_.push_back(slots_ + i);
    slots_ += kSlotsOfChunk;
  }
  const std::uint32_t index = free_.back();
  free_.pop_back();
  Slot& slot = this->slot(index);
  slot.kind = kind;
  slot.process = forks.load(std::memory_order_relaxed);
  slot.object = std::move(object);
  const std::uint64_t generation = (slot.word.load(std::memory_order_relaxed) >> 32) + 1;
  slot.word.store(generation << 32 | kOpen, std::memory_order_release);
  return reinterpret_cast<void*>(generation << 32 | (std::uint64_t{index} + 1) << 4);
}

HandleTable::Slot* HandleTable::enter(const void* handle) {
  const auto value = reinterpret_cast<std::uint64_t>(handle);
  const std::uint64_t index = ((value & UINT32_MAX) >> 4) - 1;
  if ((value & 15) != 0 || index >= std::uint64_t{kChunks} * kSlotsOfChunk) return nullptr;
  Slot* const chunk = chunks_[index / kSlotsOfChunk].load(std::memory_order_acquire);
  if (chunk == nullptr) return nullptr;
  Slot& slot = chunk[index % kSlotsOfChunk];
  std::uint64_t word = slot.word.load(std::memory_order_acquire);
  do {
    if (word >> 32 != value >> 32 || (word & kOpen) == 0) return nullptr;
  } while (!slot.word.compare_exchange_weak(word, word + 1, std::memory_order_acq_rel));
  return &slot;
}

void HandleTable::leave(std::uint32_t index) {
  Slot& slot = this->slot(index);
  const std::uint64_t after = slot.word.fetch_sub(1, std::memory_order_acq_rel) - 1;
  if ((after & (kOpen | kUsers)) != 0) return;
  const std::shared_ptr<void> object = std::move(slot.object);  // closed and unused: this thread alone has the slot
  slot.object.reset();
  const std::lock_guard lock(mutex_);
  free_.push_back(index);
}

void HandleTable::refuse(const void* handle, const char* name) const {
  throw UsageError(argument(name) + (handle == nullptr ? "is NULL" : "is closed, or was never opened"));
}

HandleTable::Use HandleTable::use(const void* handle, HandleKind kind, const char* name) {
  Slot* const slot = enter(handle);
  if (slot == nullptr) refuse(handle, name);
  const auto index = static_cast<std::uint32_t>(((reinterpret_cast<std::uint64_t>(handle) & UINT32_MAX) >> 4) - 1);
  Use use(this, index, slot->object.get());
  if (slot->kind != kind) throw UsageError(argument(name) + "is a handle of another kind");
  if (slot->process != forks.load(std::memory_order_relaxed))
    throw UsageError(argument(name) + "was opened before fork(); open it again in the child process");
  return use;
}

void HandleTable::close(const void* handle, HandleKind kind, const char* name) {
  if (handle == nullptr) return;
  Slot* const slot = enter(handle);
  if (slot == nullptr) refuse(handle, name);
  const auto index = static_cast<std::uint32_t>(((reinterpret_cast<std::uint64_t>(handle) & UINT32_MAX) >> 4) - 1);
  const Use use(this, index, slot->object.get());
  if (slot->kind != kind) throw UsageError(argument(name) + "is a handle of another kind");
  if (slot->process != forks.load(std::memory_order_relaxed)) return;  // its threads are not in this process
  if ((slot->word.fetch_and(~kOpen, std::memory_order_acq_rel) & kOpen) == 0) refuse(handle, name);
}

}  // namespace filiform::c
