#include "tools/python/internal/open_set.h"

#include <atomic>

namespace filiform::python {

namespace {

std::uint64_t nextSerial() {
  static std::atomic<std::uint64_t> serial{0};
  return ++serial;
}

}  // namespace

OpenSet::OpenSet(const std::string& name, const std::string& revision, const RemoteOptions& remote,
                 std::uint64_t budget_bytes)
    : set_(TileSet::open(name, remote, revision)),
      kept_(*set_, budget_bytes / 4),
      nearest_(kept_, {.budget_bytes = budget_bytes}),
      filtered_(kept_, budget_bytes / 4),
      looks_(nearest_.tiles(), budget_bytes / 16),
      sample_ids_(*set_, budget_bytes / 4),
      serial_(nextSerial()) {}

std::int64_t OpenSet::sampleOf(const SegmentId& segment) const {
  // Consecutive results are often on one cell. Keeps that cell's ids without a lock.
  struct Last {
    std::uint64_t serial = 0;
    std::uint32_t cell = 0;
    std::shared_ptr<const tools::SampleIds::OfCell> ids;
  };
  static thread_local Last last;
  if (last.serial != serial_ || last.cell != segment.cell)
    last = {serial_, segment.cell, sample_ids_.cell(segment.cell)};
  return last.ids->of(segment.segment);
}

const Levels* OpenSet::levels() const {
  const std::lock_guard lock(levels_mutex_);
  if (!levels_) levels_ = Levels::open(*set_);
  return levels_->get();
}

}  // namespace filiform::python
