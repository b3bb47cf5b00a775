// CellIntake: keeps what an ingest needs of all cells: their records, names, somata and attributes in memory, their
// details in the spool.
#pragma once

#include "index/ingest/tiling/internal/cell_work.h"

#include <cstdint>
#include <functional>
#include <string>
#include <vector>

namespace filiform::internal {

inline constexpr std::uint32_t kMostCells = UINT32_MAX - 1;

// Thread rule: thread-compatible. Throws IoError if the spool cannot be written or read.
class CellIntake {
 public:
  explicit CellIntake(Spool& spool) : details_(spool) {}

  // Takes the next cell, in the order of ids. O(bytes of its detail).
  void take(TakenCell cell);
  // For another rank: passes on all cells and frees them. Call keepForOthers() before the first cell.
  void keepForOthers() { for_others_ = true; }
  void handOver(ByteChain& out);
  // Takes the cells that another rank handed over.
  void take(ByteChain& handed_over);
  // Names the cells. Call it once, after the last cell.
  void finish();

  const std::vector<CellRecord>& records() const { return records_; }     // names: after finish()
  const std::vector<std::uint64_t>& digests() const { return digests_; }  // by cell
  const std::vector<SomaRoot>& somata() const { return somata_; }         // root samples of type soma
  const AttributeTable& attributes() const { return attributes_; }
  GridBox bounds() const;                                               // of all samples. O(cells)
  std::uint64_t segments() const { return segments_; }                  // isolated ones included
  std::uint64_t bytes() const { return bytes_ + attributes_.bytes(); }  // estimated memory of all records
  // Moves the details to a file if they take more than `most_bytes`. Call it after finish(). Throws IoError.
  void limitDetails(std::uint64_t most_bytes);
  // Calls `use` for each cell with its detail from encodeDetail(), without the number of tiles, and frees the detail.
  // Call it at most once, after finish().
  void readDetails(const std::function<void(std::uint32_t cell, ByteSpan detail)>& use);

 private:
  ByteChain details_;  // each after its size
  std::vector<CellRecord> records_;
  std::vector<std::uint64_t> digests_;
  std::vector<std::string> given_names_;
  std::vector<SomaRoot> somata_;
  AttributeTable attributes_;
  bool for_others_ = false;
  std::vector<std::vector<CellAttribute>> given_attributes_;  // by cell, for another rank
  std::uint64_t segments_ = 0, bytes_ = 0;
};

}  // namespace filiform::internal
