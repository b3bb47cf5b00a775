// Builds a Cell from the samples and links of one SWC input: id blocks, parents by id to parents by rank, cycles.
// Writes every remark, dropped line and cut link into a report. Thread rule: thread-compatible.
#pragma once

#include "index/cell/cell.h"
#include "index/formats/swc/internal/id_table.h"
#include "index/reports/input_report.h"

#include <array>
#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

namespace filiform::internal {

// Collects records. Counts are exact; tokens and remarks are kept up to InputReport::kTokensKept a code.
class RecordBook {
 public:
  void remark(InputCode code, std::uint64_t line, std::string_view token = {}) {
    add(code, Effect::kRemark, line, token);
  }
  void dropLine(InputCode code, std::uint64_t line, std::string_view token) {
    add(code, Effect::kLineDropped, line, token);
  }
  void cutLink(InputCode code, std::uint64_t line, std::string_view token) { add(code, Effect::kLinkCut, line, token); }
  void refuse(InputCode code, std::uint64_t line = 0, std::string_view token = {}) {
    add(code, Effect::kInputRefused, line, token);
  }
  std::uint64_t count(InputCode code) const { return counts_[static_cast<std::size_t>(code)]; }
  void clear();
  // Cut links whose lines do not ascend. Adds them by line; the first ones keep their tokens.
  class Unordered {
   public:
    explicit Unordered(RecordBook& book) : book_(&book) {}
    Unordered(const Unordered&) = delete;
    Unordered& operator=(const Unordered&) = delete;
    ~Unordered() = default;
    void cutLink(InputCode code, std::uint64_t line, std::string_view token);
    void add();

   private:
    RecordBook* book_;
    std::vector<InputRecord> records_;
  };
  // Moves all records into `report`, and empties the book.
  void moveTo(InputReport& report);

 private:
  static constexpr std::size_t kTokenLength = 40;
  void add(InputCode code, Effect effect, std::uint64_t line, std::string_view token);

  std::array<std::uint64_t, kInputCodes> counts_{};
  InputRecords records_;
};

struct SwcSample {
  std::int64_t id = 0;
  Vector3d position_um = Vector3d::Zero();
  float radius_um = 0;
  double odd_radius_um = 0;  // 0: not odd (index/cell/radius.h)
  std::uint16_t type = 0;
  enum class Parent : std::uint8_t { kRoot, kId, kUnreadable } parent_kind = Parent::kRoot;
  std::int64_t parent = -1;       // for kId; values below -1, and 0, may mean a root
  std::string_view parent_token;  // for the record
};

class SwcGraph {
 public:
  explicit SwcGraph(RecordBook& book) : book_(&book) {}

  // Adds a sample with valid id and position. Returns false if it was dropped, and reported, as W_DUP_ID. O(1)
  // expected.
  bool add(const SwcSample& sample, std::uint64_t line);
  // Call it for a line with a valid id that was dropped for another reason.
  void noteDropped(std::int64_t id);

  // Resolves open links, cuts cycles, counts, and moves the arrays into `cell`: all but source and digest. O(samples).
  void finish(Cell& cell, InputReport& report);
  void clear();

  std::uint64_t samples() const { return cell_.sample_ids.size(); }
  // Memory that reading takes with `times` as many samples as now, growth and finish() included.
  std::uint64_t bytes(double times = 1) const;

 private:
  // Arrays with more room than that are freed after the cell, and grow by quarters.
  static constexpr std::size_t kKept = Cell::kSamplesKept;
  struct OpenLink {
    std::uint32_t child;
    std::int64_t parent;
  };

  void growBeyondKept();
  bool startsBlock(const SwcSample& sample) const;
  void startBlock();
  void closeBlock();
  void link(const SwcSample& sample, std::uint32_t rank, std::uint64_t line);
  void cutCycles();
  void count(InputReport& report);

  RecordBook* book_;
  Cell cell_;
  std::size_t room_ = kKept;  // samples
  IdTable ids_;               // of the current block
  bool block_has_first_id_ = false;
  std::int64_t block_first_id_ = 0;
  bool block_dropped_zero_ = false;
  std::vector<OpenLink> open_;  // of the current block: parents not met yet
  std::uint64_t links_given_ = 0, links_cut_ = 0;
  bool later_parents_ = false;
};

}  // namespace filiform::internal
