// IngestProgress: shows the progress of an ingest on a terminal, and writes it as lines if asked. Throws Interrupted
// after a signal. Thread rule: thread-compatible.
#pragma once

#include "tools/program/progress.h"
#include "tools/program/progress_log.h"

#include <cstdint>
#include <memory>
#include <optional>
#include <string>

namespace filiform::tools {

class IngestProgress {
 public:
  // `log_s`: seconds between lines on standard error; 0: no lines.
  explicit IngestProgress(double log_s);

  // Bytes of the input.
  void read(std::uint64_t done, std::uint64_t total);
  void endReading() { reading_.finish(); }
  // As IngestOptions::progress. The step "reading" counts segments, beside the bytes of read().
  void build(const char* phase, std::uint64_t done, std::uint64_t total);
  void end();

 private:
  Progress reading_{{.title = "reading", .noun = "", .unit = ProgressUnit::bytes}};
  std::unique_ptr<Progress> building_;
  std::string phase_;
  std::uint64_t read_ = 0, to_read_ = 0, segments_ = 0;
  std::optional<ProgressLog> log_;
};

}  // namespace filiform::tools
