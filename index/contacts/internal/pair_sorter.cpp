#include "index/contacts/internal/pair_sorter.h"

#include "index/count_text.h"
#include "index/errors.h"
#include "index/workers.h"

#include <algorithm>
#include <queue>
#include <string>

namespace filiform::internal {
namespace {

void sortPairs(std::vector<ContactPair>& pairs) {
  std::sort(pairs.begin(), pairs.end(), [](const ContactPair& a, const ContactPair& b) { return a.key() < b.key(); });
}

}  // namespace

// Reads one sorted run: of the file through a window, or of memory.
class PairSorter::Source {
 public:
  explicit Source(std::span<const ContactPair> pairs) : rest_(pairs) {}
  Source(const UnnamedFile& file, const Run& run, std::size_t window)
      : file_(&file), at_(run.at), left_(run.count), window_(std::min<std::uint64_t>(window, run.count)) {
    fill();
  }
  bool empty() const { return rest_.empty(); }
  const ContactPair& front() const { return rest_.front(); }
  void pop() {
    rest_ = rest_.subspan(1);
    if (rest_.empty() && left_ > 0) fill();
  }

 private:
  void fill() {
    const std::size_t count = std::min<std::uint64_t>(left_, window_.size());
    file_->read(at_, window_.data(), count * sizeof(ContactPair));
    at_ += count * sizeof(ContactPair);
    left_ -= count;
    rest_ = std::span(window_).first(count);
  }
  const UnnamedFile* file_ = nullptr;
  std::uint64_t at_ = 0, left_ = 0;
  std::vector<ContactPair> window_;
  std::span<const ContactPair> rest_;
};

PairSorter::PairSorter(std::uint64_t memory_bytes, unsigned workers)
    : memory_bytes_(memory_bytes),
      // A growing buffer takes half as much again.
      most_buffered_(std::max<std::size_t>(memory_bytes / 2 / workers / sizeof(ContactPair), 256)),
      buffers_(workers) {}

std::uint64_t PairSorter::pairs() const {
  std::uint64_t count = file_end_ / sizeof(ContactPair);
  for (const auto& buffer : buffers_) count += buffer.size();
  return count;
}

void PairSorter::spill(std::vector<ContactPair>& buffer) {
  sortPairs(buffer);
  std::uint64_t at = 0;
  {
    const std::lock_guard lock(mutex_);
    file_.create();
    at = file_end_;
    file_end_ += buffer.size() * sizeof(ContactPair);
    runs_.push_back({at, buffer.size()});
  }
  file_.write(at, buffer.data(), buffer.size() * sizeof(ContactPair));
  buffer.clear();
}

void PairSorter::forEachCellPair(const std::function<void(std::span<const ContactPair>)>& visit) {
  runItems(buffers_.size(), buffers_.size(), [&](std::size_t i) { sortPairs(buffers_[i]); });
  const std::uint64_t windows_bytes = memory_bytes_ / 4;
  const std::size_t window = std::clamp<std::uint64_t>(
      windows_bytes / std::max<std::size_t>(runs_.size(), 1) / sizeof(ContactPair), 16, 16384);
  std::vector<Source> sources;
  sources.reserve(runs_.size() + buffers_.size());
  for (const Run& run : runs_) sources.emplace_back(file_, run, window);
  for (const auto& buffer : buffers_)
    if (!buffer.empty()) sources.emplace_back(buffer);
  const auto later = [&](std::size_t a, std::size_t b) { return sources[b].front().key() < sources[a].front().key(); };
  std::priority_queue<std::size_t, std::vector<std::size_t>, decltype(later)> next(later);
  for (std::size_t i = 0; i < sources.size(); ++i) next.push(i);
  std::vector<ContactPair> pairs;
  const std::size_t most = std::max<std::uint64_t>(memory_bytes_ / 4 / sizeof(ContactPair), 1 << 16);
  while (!next.empty()) {
    const std::size_t at = next.top();
    next.pop();
    // Mostly the next pairs of this source come first too.
    do {
      const ContactPair& pair = sources[at].front();
      if (!pairs.empty() && pairs.back().cell != pair.cell) {
        visit(pairs);
        pairs.clear();
      }
      if (pairs.size() == most)
        throw InputError("cells " + std::to_string(pair.cell[0]) + " and " + std::to_string(pair.cell[1]) +
                         " have more than " + formatCount(most) +
                         " pairs of segments within the distance: give more memory, or a smaller distance");
      pairs.push_back(pair);
      sources[at].pop();
    } while (!sources[at].empty() && (next.empty() || sources[at].front().key() < sources[next.top()].front().key()));
    if (!sources[at].empty()) next.push(at);
  }
  if (!pairs.empty()) visit(pairs);
}

}  // namespace filiform::internal
