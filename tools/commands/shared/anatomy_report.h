// What `check` says about the anatomy of cells: text, JSON, and which inputs --profile strict refuses. Functions
// without state.
#pragma once

#include "index/anatomy/input_anatomy.h"
#include "index/input/source_report.h"

#include <cstdint>
#include <string>
#include <vector>

#include <nlohmann/json.hpp>

namespace filiform::tools {

// A doubt has a line with its cell, and a second one that says what to do next. A kind of note has one such pair, with
// the number of its cells and the first of them. Each line ends with a newline.
std::string anatomyText(const InputAnatomy& anatomy);
// `{"long_links": {"doubts": 1, "notes": 0}, ...}`: the numbers of cells; only kinds that occur.
nlohmann::ordered_json anatomyCountsJson(const InputAnatomy& anatomy);
// Requires that the finding's places are complete: at most Finding::kMostPlaces.
nlohmann::ordered_json findingJson(const Finding& finding);

// Finds the cells of a source. `cells` must outlive this object. Thread rule: thread-compatible.
class FindingsBySource {
 public:
  explicit FindingsBySource(const std::vector<CellFindings>& cells);
  // The cells that were read from a file, or from the entries of a container, in the order of the report. O(log cells +
  // those) for each entry.
  std::vector<const CellFindings*> of(const SourceReport& row) const;
  std::vector<const CellFindings*> of(const SourceReport& row, const EntryReport& entry) const;

 private:
  std::vector<const CellFindings*> exactly(const std::string& source, std::uint64_t digest) const;

  std::vector<const CellFindings*> by_source_;
};

// Refuses the inputs that hold a cell with a doubt: --profile strict.
void refuseDoubtful(std::vector<SourceReport>& reports, const FindingsBySource& findings);

}  // namespace filiform::tools
