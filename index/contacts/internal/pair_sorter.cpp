#include "index/contacts/internal/pair_sorter.h"

#include "index/count_text.h"
#include "index/errors.h"
#include "index/workers.h"

#include <algorithm>
#include <cstring>
#include <numeric>
#include <queue>
#include <string>

namespace filiform::internal {
namespace {

constexpr std::size_t kMostInBlock = 64;  // pairs
constexpr std::size_t kMostBlockBytes = sizeof(PairBlock) + kMostInBlock * kMostPairBytes;
constexpr std::size_t kWindow = std::size_t{1} << 20;  // of the file, bytes

std::uint64_t pairKey(const std::array<std::uint32_t, 2>& of) { return std::uint64_t{of[0]} << 32 | of[1]; }

constexpr auto isBefore = [](const ContactPair& a, const ContactPair& b) {
  const std::uint64_t cells_a = pairKey(a.cell), cells_b = pairKey(b.cell);
  return cells_a != cells_b ? cells_a < cells_b : pairKey(a.segment) < pairKey(b.segment);
};

PairBlock blockHead(const std::uint8_t* at) {
  PairBlock head;
  std::memcpy(&head, at, sizeof head);
  return head;
}

}  // namespace

// Reads blocks in the order of their cells: of a run of the file through a window, or of memory.
class PairSorter::Source {
 public:
  explicit Source(std::span<const Kept> blocks) : blocks_(blocks) { setHead(); }
  Source(const UnnamedFile& file, const Run& run, std::size_t window) : file_(&file), run_(run), window_(window) {
    setHead();
  }
  bool empty() const { return at_ == nullptr; }
  std::uint64_t cells() const { return cells_; }
  PairBlock head() const { return blockHead(at_); }
  const std::uint8_t* bytes() const { return at_ + sizeof(PairBlock); }
  void pop() {
    if (file_ == nullptr)
      blocks_ = blocks_.subspan(1);
    else
      used_ += sizeof(PairBlock) + head().bytes;
    setHead();
  }

 private:
  void setHead() {
    at_ = nullptr;
    if (file_ == nullptr) {
      if (!blocks_.empty()) at_ = blocks_[0].at;
    } else if (used_ < filled_ || run_.begin < run_.end) {
      const auto isWhole = [&] {
        const std::size_t left = filled_ - used_;
        return left >= sizeof(PairBlock) && left >= sizeof(PairBlock) + blockHead(&window_[used_]).bytes;
      };
      if (!isWhole()) fill();
      at_ = &window_[used_];
    }
    if (at_ != nullptr) cells_ = pairKey(head().cells);
  }
  // A window has room for any block.
  void fill() {
    std::memmove(window_.data(), window_.data() + used_, filled_ -= used_);
    used_ = 0;
    const std::size_t more = std::min<std::uint64_t>(run_.end - run_.begin, window_.size() - filled_);
    file_->read(run_.begin, window_.data() + filled_, more);
    run_.begin += more, filled_ += more;
  }

  std::span<const Kept> blocks_;
  const UnnamedFile* file_ = nullptr;
  Run run_{};
  std::vector<std::uint8_t> window_;
  std::size_t used_ = 0, filled_ = 0;  // of the window
  const std::uint8_t* at_ = nullptr;
  std::uint64_t cells_ = 0;
};

PairSorter::PairSorter(std::uint64_t memory_bytes, unsigned workers, bool are_counted)
    : memory_bytes_(memory_bytes),
      are_counted_(are_counted),
      page_bytes_(std::clamp<std::size_t>(memory_bytes / 8 / workers, 4096, 1 << 20)),
      most_pages_(std::max<std::size_t>(memory_bytes / 8 * 5 / workers / page_bytes_, 1)),
      buffers_(workers) {}

std::uint64_t PairSorter::pairs() const {
  return std::accumulate(buffers_.begin(), buffers_.end(), std::uint64_t{0},
                         [](std::uint64_t sum, const Buffer& buffer) { return sum + buffer.pairs; });
}

void PairSorter::add(std::size_t worker, std::span<ContactPair> pairs) {
  Buffer& buffer = buffers_[worker];
  buffer.pairs += pairs.size();
  std::sort(pairs.begin(), pairs.end(), isBefore);
  for (std::size_t begin = 0, end = 0; begin < pairs.size(); begin = end) {
    while (end < pairs.size() && end - begin < kMostInBlock && pairs[end].cell == pairs[begin].cell) ++end;
    keep(buffer, pairs.subspan(begin, end - begin));
  }
}

void PairSorter::keep(Buffer& buffer, std::span<const ContactPair> pairs) {
  std::uint8_t bytes[kMostBlockBytes];
  const auto size = static_cast<std::size_t>(encodePairs(pairs, are_counted_, bytes + sizeof(PairBlock)) - bytes);
  const PairBlock head{pairs[0].cell, static_cast<std::uint16_t>(pairs.size()),
                       static_cast<std::uint16_t>(size - sizeof(PairBlock))};
  std::memcpy(bytes, &head, sizeof head);
  if (buffer.left < size) {
    if (buffer.pages.size() == most_pages_) spill(buffer);
    buffer.left = std::max(page_bytes_, size);
    buffer.at = buffer.pages.emplace_back(new std::uint8_t[buffer.left]).get();
  }
  std::memcpy(buffer.at, bytes, size);
  buffer.blocks.push_back({pairKey(head.cells), buffer.at});
  buffer.at += size, buffer.left -= size;
}

void PairSorter::sortBlocks(Buffer& buffer) {
  std::sort(buffer.blocks.begin(), buffer.blocks.end(), [](const Kept& a, const Kept& b) { return a.cells < b.cells; });
}

void PairSorter::spill(Buffer& buffer) {
  sortBlocks(buffer);
  std::vector<std::uint8_t> window;
  std::uint64_t bytes = 0;
  for (const Kept& block : buffer.blocks) bytes += sizeof(PairBlock) + blockHead(block.at).bytes;
  std::uint64_t at = 0;
  {
    const std::lock_guard lock(mutex_);
    file_.create();
    at = file_end_;
    file_end_ += bytes;
    runs_.push_back({at, file_end_});
  }
  const auto flush = [&] {
    file_.write(at, window.data(), window.size());
    at += window.size();
    window.clear();
  };
  for (const Kept& block : buffer.blocks) {
    window.insert(window.end(), block.at, block.at + sizeof(PairBlock) + blockHead(block.at).bytes);
    if (window.size() >= kWindow) flush();
  }
  flush();
  buffer.blocks.clear(), buffer.pages.clear();
}

void PairSorter::forEachCellPair(const std::function<void(std::span<const ContactPair>)>& visit) {
  runItems(buffers_.size(), buffers_.size(), [&](std::size_t i) { sortBlocks(buffers_[i]); });
  const std::size_t window =
      std::clamp<std::uint64_t>(memory_bytes_ / 8 / std::max<std::size_t>(runs_.size(), 1), kMostBlockBytes, kWindow);
  std::vector<Source> sources;
  sources.reserve(runs_.size() + buffers_.size());
  for (const Run& run : runs_) sources.emplace_back(file_, run, window);
  for (const Buffer& buffer : buffers_)
    if (!buffer.blocks.empty()) sources.emplace_back(buffer.blocks);
  const auto later = [&](std::size_t a, std::size_t b) { return sources[b].cells() < sources[a].cells(); };
  std::priority_queue<std::size_t, std::vector<std::size_t>, decltype(later)> next(later);
  for (std::size_t i = 0; i < sources.size(); ++i) next.push(i);
  std::vector<ContactPair> pairs;
  const std::size_t most = std::max<std::uint64_t>(memory_bytes_ / 8 / sizeof(ContactPair), 1 << 16);
  while (!next.empty()) {
    const std::uint64_t cells = sources[next.top()].cells();
    pairs.clear();
    while (!next.empty() && sources[next.top()].cells() == cells) {
      const std::size_t at = next.top();
      next.pop();
      Source& source = sources[at];
      for (; !source.empty() && source.cells() == cells; source.pop()) {
        const PairBlock head = source.head();
        if (pairs.size() + head.pairs > most)
          throw InputError("cells " + std::to_string(head.cells[0]) + " and " + std::to_string(head.cells[1]) +
                           " have more than " + formatCount(most) +
                           " pairs of segments within the distance: give more memory, or a smaller distance");
        decodePairs(head, source.bytes(), are_counted_, pairs);
      }
      if (!source.empty()) next.push(at);
    }
    std::sort(pairs.begin(), pairs.end(), isBefore);
    visit(pairs);
  }
}

}  // namespace filiform::internal
