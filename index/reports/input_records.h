// The records of an input (input_report.h), in a few bytes each, since millions of lines may be dropped.
//
// Consecutive records with the same code, no token and equal steps of the line form one entry. Beyond 1 MiB in the
// process, records go to one temporary file without a name, in $TMPDIR or /tmp. Thread rule: values, thread-compatible.
#pragma once

#include "index/errors.h"

#include <array>
#include <cstddef>
#include <cstdint>
#include <iterator>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

namespace filiform {

enum class InputCode : std::uint8_t;

// What a record says was done.
enum class Effect : std::uint8_t { kRemark, kLineDropped, kLinkCut, kInputRefused };
// What was done: "kept", "dropped", "cut"; "left_out" for a whole input.
std::string_view name(Effect effect);

// One remark on an input, or one thing that was dropped or cut.
struct InputRecord {
  std::uint64_t line = 0;  // from 1; 0: no particular line
  InputCode code{};
  Effect effect = Effect::kRemark;
  std::string token;  // text at that place, escaped and cut; empty after the first kTokensKept records of a code
};

namespace internal {
class RecordStore;
}

class InputRecords {
 public:
  // Adds a record. Records are sorted by line; equal lines keep the order of insertion. O(1) if lines ascend, except
  // for a few sequences. Throws IoError if the temporary file cannot be created or written.
  void add(const InputRecord& record);
  // Inserts a record of line 0 before all others. No add() may follow.
  void addFirst(InputRecord record);
  // Ends adding and frees the memory kept for further records.
  void close();
  void clear();

  std::uint64_t size() const { return size_; }
  bool empty() const { return size_ == 0; }
  std::uint64_t count(Effect effect) const { return counts_[static_cast<std::size_t>(effect)]; }
  InputRecord front() const;                          // requires !empty()
  InputRecord operator[](std::uint64_t place) const;  // O(place); requires place < size()

  // Iterates by line. Throws IoError if the temporary file cannot be read. Valid while the records stay unchanged.
  class Iterator;
  Iterator begin() const;
  std::default_sentinel_t end() const { return {}; }

 private:
  // A sequence of ascending lines, encoded.
  struct Piece {
    std::uint64_t at, bytes;  // in the store
  };
  struct Run {
    std::uint64_t line = 0, step = 0, count = 0;  // count 0: no run
    InputCode code{};
    Effect effect = Effect::kRemark;
    std::string token;
  };
  struct Tape {
    std::vector<Piece> pieces;
    std::vector<std::uint8_t> held;
    Run run;                      // the run not yet encoded
    std::uint64_t last_line = 0;  // of the last record added
    std::uint64_t base = 0;       // first line of the run encoded last
  };
  class TapeReader;
  static void encode(Tape& tape);
  void put(Tape& tape);

  std::vector<Tape> tapes_;
  std::shared_ptr<internal::RecordStore> store_;
  std::uint64_t size_ = 0;
  std::array<std::uint64_t, 4> counts_{};
};

// Walks the records by line. A single-pass input iterator.
class InputRecords::Iterator {
 public:
  using iterator_concept = std::input_iterator_tag;
  using value_type = InputRecord;
  using difference_type = std::ptrdiff_t;

  explicit Iterator(const InputRecords& records);
  Iterator(Iterator&&) noexcept;
  Iterator& operator=(Iterator&&) noexcept;
  ~Iterator();
  const InputRecord& operator*() const { return record_; }
  const InputRecord* operator->() const { return &record_; }
  Iterator& operator++();
  void operator++(int) { ++*this; }
  bool operator==(std::default_sentinel_t) const { return done_; }

 private:
  std::vector<TapeReader> readers_;
  InputRecord record_;
  bool done_ = false;
};

}  // namespace filiform
