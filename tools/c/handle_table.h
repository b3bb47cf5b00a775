// HandleTable: the objects behind the handles of filiform.h. A handle is a slot and a generation, not a pointer, so a
// closed or invented handle is found out. Using a handle neither locks nor allocates. Thread rule: internally
// synchronised.
#pragma once

#include <array>
#include <atomic>
#include <cstdint>
#include <memory>
#include <mutex>
#include <vector>

namespace filiform::c {

enum class HandleKind : std::uint8_t { set, cell, travel };

class HandleTable {
 public:
  // The table of the process. It is never destroyed, so that handles may be closed while the program exits.
  static HandleTable& ofProcess();

  // A handle in use: the object lives as long as this one.
  class Use {
   public:
    Use(Use&& other) noexcept : table_(other.table_), index_(other.index_), object_(other.object_) {
      other.table_ = nullptr;
    }
    Use(const Use&) = delete;
    Use& operator=(const Use&) = delete;
    ~Use() {
      if (table_ != nullptr) table_->leave(index_);
    }
    void* object() const { return object_; }

   private:
    friend class HandleTable;
    Use(HandleTable* table, std::uint32_t index, void* object) : table_(table), index_(index), object_(object) {}
    HandleTable* table_;
    std::uint32_t index_;
    void* object_;
  };

  // Throws IoError for more than a million open handles; std::bad_alloc.
  void* add(HandleKind kind, std::shared_ptr<void> object);
  // Throws UsageError if the handle is null, closed, invented, of another kind, or of the parent process. `name`: of
  // the argument, for the message. Haptic-safe.
  Use use(const void* handle, HandleKind kind, const char* name);
  // Closes a handle; its object is destroyed when no call uses it any more. Throws as use() does, except for a handle
  // of the parent process: that does nothing.
  void close(const void* handle, HandleKind kind, const char* name);

 private:
  static constexpr std::uint32_t kSlotsOfChunk = 1024, kChunks = 1024;
  static constexpr std::uint64_t kOpen = std::uint64_t{1} << 31;
  static constexpr std::uint64_t kUsers = kOpen - 1;

  // `word`: generation in the upper half, then whether it is open, then the number of calls that use it.
  struct Slot {
    std::atomic<std::uint64_t> word{0};
    HandleKind kind{};
    std::uint32_t process = 0;  // number of fork()s before
    std::shared_ptr<void> object;
  };

  Slot& slot(std::uint32_t index) const { return chunks_[index / kSlotsOfChunk].load()[index % kSlotsOfChunk]; }
  // Nullptr: closed or invented.
  Slot* enter(const void* handle);
  void leave(std::uint32_t index);
  void refuse(const void* handle, const char* name) const;

  mutable std::array<std::atomic<Slot*>, kChunks> chunks_{};
  std::mutex mutex_;  // of what follows
  std::uint32_t slots_ = 0;
  std::vector<std::uint32_t> free_;
};

}  // namespace filiform::c
