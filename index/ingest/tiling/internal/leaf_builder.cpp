#include "index/ingest/tiling/internal/leaf_builder.h"

#include "index/errors.h"
#include "index/ingest/tiling/internal/crowded_leaves.h"

#include <algorithm>
#include <array>
#include <numeric>
#include <string>
#include <utility>

namespace filiform::internal {
namespace {

constexpr std::uint32_t kNoLeaf = UINT32_MAX;

std::uint64_t segmentsIn(std::span<SegmentChain* const> chains) {
  std::uint64_t sum = 0;
  for (const SegmentChain* chain : chains) sum += chain->count();
  return sum;
}

// Sorts items that consist of a few sorted runs, as they come from a few chains. `fetch` begins to load an item.
template <typename Less, typename Fetch>
void sortRuns(std::span<std::uint32_t> values, std::vector<std::size_t>& runs, Less less, Fetch fetch) {
  constexpr std::size_t kManyRuns = 64, kAhead = 16;
  runs.assign(1, 0);
  for (std::size_t i = 1; i < values.size(); ++i) {
    if (i + kAhead < values.size()) fetch(values[i + kAhead]);
    if (less(values[i], values[i - 1])) {
      if (runs.size() == kManyRuns) {
        std::sort(values.begin(), values.end(), less);
        return;
      }
      runs.push_back(i);
    }
  }
  if (runs.size() == 1) return;
  const auto at = [&](std::size_t run) {
    return values.begin() + static_cast<std::ptrdiff_t>(run < runs.size() ? runs[run] : values.size());
  };
  for (std::size_t width = 1; width < runs.size(); width *= 2)
    for (std::size_t run = 0; run + width < runs.size(); run += 2 * width)
      std::inplace_merge(at(run), at(run + width), at(run + 2 * width), less);
}

}  // namespace

LeafBuilder::LeafBuilder(const Partition& partition, Spool& spool, SegmentChain& long_segments, std::uint64_t capacity,
                         HandOver hand_over)
    : partition_(partition),
      spool_(spool),
      long_segments_(long_segments),
      capacity_(capacity),
      hand_over_(std::move(hand_over)) {}

std::uint64_t LeafBuilder::cost(std::uint64_t segments) const {
  return segments * kBytesTogether + tileCost(std::min(segments, 2 * capacity_));
}

void LeafBuilder::refuse(std::uint64_t stored, std::uint64_t needed_memory) {
  throw InputError("one tile stores " + std::to_string(stored) +
                   " segments that meet in one place, which takes more memory than is given; ingest with --memory " +
                   std::to_string((needed_memory >> 20) + 1) + "MiB");
}

void LeafBuilder::release() {
  closed_ = {};
  records_ = {};
  items_ = {};
  placed_ = {};
  stored_ = {};
  ends_ = {};
  long_ = {};
  content_ = {};
}

void LeafBuilder::enter(const Range& range) {
  first_ = owner_ = range.first;
  end_ = range.end;
  path_ = partition_.path(range.core);
  core_ = range.core.box();
  closed_.clear();
  closed_.reserve(end_ - first_);
  for (std::uint32_t leaf = first_; leaf < end_; ++leaf) closed_.push_back(closedBlock(partition_.leaves()[leaf]));
}

// Calls use(leaf, owned) for each leaf of the range that stores the segment. Returns true for a long segment whose
// midpoint is in the range, in the leaf `owner_`.
template <typename Use>
bool LeafBuilder::forEachLeaf(const SegmentRecord& r, const Use& use) {
  const GridPoint middle = midpoint(r.child, r.parent);
  std::uint32_t owner = owner_;
  const GridBox& last = closed_[owner - first_];
  if (!last.contains(middle) || middle[0] == last.hi[0] || middle[1] == last.hi[1] || middle[2] == last.hi[2]) {
    owner = kNoLeaf;
    if (core_.contains(middle)) {
      const std::uint32_t home = partition_.home(path_.back(), middle);
      if (home >= first_ && home < end_) owner_ = owner = home;
    }
  }
  if (owner != kNoLeaf && strictlyInside(closed_[owner - first_], r.child, r.parent)) {
    use(owner, true);
    return false;
  }
  std::size_t from = path_.size() - 1;
  while (from > 0 && !strictlyInside(path_[from].block, r.child, r.parent)) --from;
  const bool few = partition_.leavesMet(path_[from], r.child, r.parent, met_, &visited_);
  if (few) {
    for (const std::uint32_t leaf : met_)
      if (leaf >= first_ && leaf < end_) use(leaf, leaf == owner);
    return false;
  }
  const std::uint32_t home_a = partition_.home(r.child), home_b = partition_.home(r.parent);
  if (home_a >= first_ && home_a < end_) use(home_a, false);
  if (home_b != home_a && home_b >= first_ && home_b < end_) use(home_b, false);
  return owner != kNoLeaf;
}

LeafBuilder::Counts LeafBuilder::count(std::span<SegmentChain* const> chains, const Range& range) {
  enter(range);
  const std::size_t leaves = range.end - range.first;
  Counts counts{std::vector<std::uint32_t>(leaves, 0), std::vector<std::uint32_t>(leaves, 0)};
  for (SegmentChain* chain : chains) {
    SegmentChain::Reader reader(*chain, false);
    for (SegmentRecord record = SegmentChain::first(); reader.next(record);)
      if (forEachLeaf(record, [&](std::uint32_t leaf, bool) { ++counts.stored[leaf - first_]; }))
        ++counts.too_long[owner_ - first_];
  }
  return counts;
}

void LeafBuilder::build(std::span<SegmentChain* const> chains, const Range& range, MemoryBudget::Hold& hold) {
  const std::uint64_t all = segmentsIn(chains);
  if (all == 0) return;
  if (all >= kOwned || cost(all) > hold.budget().limit()) return divide(chains, range, hold);
  if (!hold.fits(cost(all))) {
    release();
    hold.wait(cost(all));
  }
  enter(range);
  if (buildTogether(chains, hold.bytes())) return;
  SegmentChain again(spool_);
  for (const SegmentRecord& record : records_) again.add(record);
  again.close();
  SegmentChain* const chain = &again;
  divide({&chain, 1}, range, hold);
}

// Returns false, with all segments in records_, if it needs more than `most_bytes`.
bool LeafBuilder::buildTogether(std::span<SegmentChain* const> chains, std::uint64_t most_bytes) {
  const std::uint64_t segments = segmentsIn(chains);
  records_.resize(segments);
  const std::uint64_t for_places = most_bytes - std::min(most_bytes, segments * kBytesOfRecord);
  stored_.assign(end_ - first_, 0);
  placed_.clear();
  long_.clear();
  std::uint32_t at = 0;
  for (SegmentChain* chain : chains) {
    SegmentChain::Reader reader(*chain, true);
    for (SegmentRecord record = SegmentChain::first(); reader.next(record); ++at) {
      records_[at] = record;
      if (placed_.size() * kBytesOfPlace > for_places) continue;
      const bool is_long = forEachLeaf(record, [&](std::uint32_t leaf, bool owned) {
        placed_.push_back(std::uint64_t{leaf - first_} << 32 | (owned ? kOwned : 0) | at);
        ++stored_[leaf - first_];
      });
      if (is_long) long_.push_back(at);
    }
  }
  for (SegmentChain* chain : chains) chain->clear();
  const std::uint32_t largest = *std::max_element(stored_.begin(), stored_.end());
  if (placed_.size() * kBytesOfPlace + tileCost(largest) > for_places) return false;

  for (const std::uint32_t i : long_) long_segments_.add(records_[i]);
  items_.resize(placed_.size());
  ends_.resize(stored_.size());
  std::exclusive_scan(stored_.begin(), stored_.end(), ends_.begin(), 0u);
  for (const std::uint64_t place : placed_) items_[ends_[place >> 32]++] = static_cast<std::uint32_t>(place);
  for (std::uint32_t i = 0; i < stored_.size(); ++i) {
    if (stored_[i] == 0) continue;
    fill(first_ + i, std::span(items_).subspan(ends_[i] - stored_[i], stored_[i]));
    hand_over_(content_);
  }
  return true;
}

// Sorts `items`: what the leaf stores.
void LeafBuilder::fill(std::uint32_t leaf, std::span<std::uint32_t> items) {
  const auto record = [&](std::uint32_t item) -> const SegmentRecord& { return records_[item & ~kOwned]; };
  sortRuns(
      items, runs_, [&](std::uint32_t a, std::uint32_t b) { return record(a).id.key() < record(b).id.key(); },
      [&](std::uint32_t item) {
        const auto* const bytes = reinterpret_cast<const char*>(&record(item));
        __builtin_prefetch(bytes);
        __builtin_prefetch(bytes + sizeof(SegmentRecord) - 1);
      });
  content_.leaf = leaf;
  content_.key = partition_.leaves()[leaf];
  content_.fill(
      items.size(), [&](std::size_t i) -> const SegmentRecord& { return record(items[i]); },
      [&](std::size_t i) { return (items[i] & kOwned) != 0; });
}

// Combines neighbouring leaves as long as they fit `share`. If there were too many parts, several are combined into one
// that does not fit.
std::vector<LeafBuilder::Part> LeafBuilder::partsOf(std::span<SegmentChain* const> chains, const Range& range,
                                                    std::uint64_t share) {
  std::vector<Part> parts;
  const Counts counts = count(chains, range);
  for (std::uint32_t leaf = range.first; leaf < range.end; ++leaf) {
    const std::uint64_t n = counts.stored[leaf - range.first];
    Part alone{leaf, leaf + 1, n, counts.too_long[leaf - range.first], n, true};
    alone.fits = alone.bytes() <= share;
    if (!parts.empty() && parts.back().fits) {
      Part together = parts.back();
      together.end = alone.end;
      together.stored += n;
      together.too_long += alone.too_long;
      together.largest = std::max(together.largest, alone.largest);
      if (together.bytes() <= share) {
        parts.back() = together;
        continue;
      }
    }
    parts.push_back(alone);
  }
  const std::size_t most_parts = std::max<std::size_t>(2, share / 4 / spool_.block_bytes());
  if (parts.size() <= most_parts) return parts;
  const std::size_t together = (parts.size() + most_parts - 1) / most_parts;
  std::vector<Part> joined;
  for (std::size_t i = 0; i < parts.size(); i += together) {
    const std::size_t last = std::min(i + together, parts.size()) - 1;
    joined.push_back(parts[i]);
    if (i == last) continue;
    joined.back().end = parts[last].end;
    joined.back().fits = false;
  }
  return joined;
}

void LeafBuilder::divide(std::span<SegmentChain* const> chains, const Range& range, MemoryBudget::Hold& hold) {
  release();
  if (!hold.fits(0)) hold.wait(0);
  const std::vector<Part> parts = partsOf(chains, range, hold.budget().share());
  std::vector<SegmentChain> pieces;
  pieces.reserve(parts.size());
  for (std::size_t i = 0; i < parts.size(); ++i) pieces.emplace_back(spool_);
  const auto part_of = [&](std::uint32_t leaf) {
    const auto after = std::upper_bound(parts.begin(), parts.end(), leaf,
                                        [](std::uint32_t l, const Part& part) { return l < part.first; });
    return static_cast<std::uint32_t>(after - parts.begin() - 1);
  };
  enter(range);
  std::vector<std::uint32_t> to;
  for (SegmentChain* chain : chains) {
    SegmentChain::Reader reader(*chain, true);
    for (SegmentRecord record = SegmentChain::first(); reader.next(record);) {
      to.clear();
      if (forEachLeaf(record, [&](std::uint32_t leaf, bool) { to.push_back(part_of(leaf)); }))
        to.push_back(part_of(owner_));
      std::sort(to.begin(), to.end());
      to.erase(std::unique(to.begin(), to.end()), to.end());
      for (const std::uint32_t part : to) pieces[part].add(record);
    }
  }
  for (SegmentChain* chain : chains) chain->clear();
  for (SegmentChain& piece : pieces) piece.close();
  for (std::size_t i = 0; i < parts.size(); ++i) {
    const Range part{parts[i].first, parts[i].end, range.core};
    SegmentChain* const piece = &pieces[i];
    if (piece->count() == 0) continue;
    if (parts[i].fits) {
      if (!hold.fits(0)) {
        release();
        hold.wait(0);
      }
      enter(part);
      buildTogether({&piece, 1}, UINT64_MAX);
    } else if (part.end - part.first > 1) {
      divide({&piece, 1}, part, hold);
    } else {
      buildAlone(*piece, parts[i], part, hold);
    }
  }
}

// Builds a single leaf. Beside its tile there is no room for its records.
void LeafBuilder::buildAlone(SegmentChain& chain, const Part& part, const Range& range, MemoryBudget::Hold& hold) {
  const std::uint64_t bytes = tileCost(part.stored);
  if (bytes > hold.budget().limit()) refuse(part.stored, memoryFor(bytes));
  if (!hold.fits(bytes)) {
    release();
    hold.wait(bytes);
  }
  enter(range);
  records_.clear();
  records_.reserve(part.stored);
  items_.clear();
  items_.reserve(part.stored);
  {
    SegmentChain::Reader reader(chain, true);
    for (SegmentRecord record = SegmentChain::first(); reader.next(record);) {
      const auto store = [&](std::uint32_t, bool owned) {
        items_.push_back(static_cast<std::uint32_t>(records_.size()) | (owned ? kOwned : 0));
        records_.push_back(record);
      };
      if (forEachLeaf(record, store)) long_segments_.add(record);
    }
  }
  chain.clear();
  if (records_.empty()) return;
  fill(range.first, items_);
  records_ = {};
  items_ = {};
  hand_over_(content_);
  content_ = {};
}

}  // namespace filiform::internal
