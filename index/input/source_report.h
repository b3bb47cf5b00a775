// The reports on what Input reads: one for each source, with those of its entries. Thread rule: values.
#pragma once

#include "index/reports/input_report.h"

#include <cstdint>
#include <string>
#include <vector>

namespace filiform {

// The report on one neuron of a container, or on an inner archive, which is not opened.
struct EntryReport {
  std::string entry;  // name in the archive, raw bytes
  std::uint64_t bytes = 0;
  std::uint64_t digest = 0;  // XXH3 of the content
  bool dropped = false;      // the whole entry was skipped or refused
  InputReport report;
  std::string label = {};  // its name in sources of cells, if that differs

  const std::string& shown_label() const { return label.empty() ? entry : label; }
};

// One row of `check`: a file argument, a file of a folder, a container (sums over its entries), or a folder that cannot
// be listed. A row or entry of severity kPassed was passed over. A container is an archive, a file of MouseLight,
// CATMAID or NML, a shard of skeletons, or skeletons at an address.
struct SourceReport {
  std::string file;       // base name of the argument, or path below the folder argument; raw bytes
  bool archive = false;   // a container
  bool left_out = false;  // not read: OTHER_VERSION
  std::uint64_t bytes = 0;
  std::uint64_t digest = 0;  // XXH3 of the content; for a container, of what lists its entries
  InputReport report;        // for an archive: sums, and records of the archive itself
  std::vector<EntryReport> entries;
};

}  // namespace filiform
