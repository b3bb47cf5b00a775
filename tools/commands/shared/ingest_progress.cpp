#include "tools/commands/shared/ingest_progress.h"

#include "tools/program/interruption.h"
#include "tools/words/numbers.h"

#include <cstdio>
#include <string_view>

namespace filiform::tools {
namespace {

constexpr std::uint64_t kSegmentsBetweenNotes = 4096;

void writeToStandardError(const std::string& line) {
  const std::string text = "filiform: " + line;
  std::fwrite(text.data(), 1, text.size(), stderr);
  std::fflush(stderr);
}

}  // namespace

IngestProgress::IngestProgress(double log_s) {
  if (log_s <= 0) return;
  log_.emplace(log_s, writeToStandardError);
  log_->begin({.title = "reading", .noun = "", .unit = ProgressUnit::bytes});
}

void IngestProgress::read(std::uint64_t done, std::uint64_t total) {
  throwIfInterrupted();
  reading_.setTotal(total);
  reading_.update(done);
  read_ = done;
  to_read_ = total;
  if (log_) log_->update(done, total, counted(segments_, "segment"));
}

void IngestProgress::build(const char* phase, std::uint64_t done, std::uint64_t total) {
  throwIfInterrupted();
  if (std::string_view(phase) == "reading") {  // read() shows this step, in bytes
    const bool notes = log_ && done / kSegmentsBetweenNotes != segments_ / kSegmentsBetweenNotes;
    segments_ = done;
    if (notes) log_->update(read_, to_read_, counted(done, "segment"));
    return;
  }
  if (phase_ != phase) {
    phase_ = phase;
    reading_.finish();
    const ProgressOptions step{.title = phase, .noun = "", .total = total};
    building_ = std::make_unique<Progress>(step);
    if (log_) log_->begin(step);
  }
  building_->setTotal(total);
  building_->update(done);
  if (log_) log_->update(done, total);
}

void IngestProgress::end() {
  if (building_) building_->finish();
  if (log_) log_->end();
}

}  // namespace filiform::tools
