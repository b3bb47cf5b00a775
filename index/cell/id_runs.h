// IdRuns: the sample ids of a cell by rank, as runs of ids that increase by one. Its memory follows the number of runs,
// not the number of ids. Thread rule: thread-compatible.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

namespace filiform {

class IdRuns {
 public:
  IdRuns() = default;
  explicit IdRuns(std::span<const std::int64_t> ids);

  // Appends ids that increase by one, modulo 2^64. Requires a count above 0, and at most 2^32 - 1 ids in all.
  void add(std::int64_t first, std::uint32_t count);

  std::uint32_t size() const { return size_; }
  // Requires rank < size(). O(log runs).
  std::int64_t operator[](std::uint32_t rank) const;
  // The ranks that have this id, ascending: more than one if ids restart. O(runs).
  std::vector<std::uint32_t> ranksOf(std::int64_t id) const;
  std::vector<std::int64_t> all() const;  // by rank; O(size)
  std::size_t bytes() const { return runs_.capacity() * sizeof(Run); }

  struct Run {
    std::uint32_t rank;  // of its first id; the run ends before that of the next run
    std::int64_t first;
    bool operator==(const Run&) const = default;
  };
  const std::vector<Run>& runs() const { return runs_; }
  std::uint32_t endOf(std::size_t run) const { return run + 1 < runs_.size() ? runs_[run + 1].rank : size_; }
  bool operator==(const IdRuns&) const = default;

 private:
  std::vector<Run> runs_;
  std::uint32_t size_ = 0;
};

}  // namespace filiform
