#include "index/ingest/ranks/internal/rank_steps.h"

#include "index/errors.h"

#include <algorithm>
#include <string>

namespace filiform::internal {
namespace {

constexpr std::uint64_t kStepsOfOutline = 4096;  // of a rank

// The first key of the range of each rank, and the end of the world. Ranges may be empty. `outlines`: of all ranks.
std::vector<MortonKey> rangesOf(std::vector<Chunks::Step> outlines, unsigned ranks) {
  std::sort(outlines.begin(), outlines.end(),
            [](const Chunks::Step& a, const Chunks::Step& b) { return a.key < b.key; });
  struct Cut {
    MortonKey key;
    std::uint64_t before;  // segments below the key
  };
  std::vector<Cut> cuts;
  std::uint64_t all = 0;
  for (const Chunks::Step& step : outlines) {
    if (step.may_cut && (cuts.empty() || cuts.back().key != step.key)) cuts.push_back({step.key, all});
    all += step.count;
  }
  std::vector<MortonKey> begins{0};
  auto rest = cuts.cbegin();
  while (begins.size() < ranks && rest != cuts.cend()) {
    const auto wanted =
        static_cast<std::uint64_t>(static_cast<double>(all) / ranks * static_cast<double>(begins.size()));
    auto best = std::lower_bound(rest, cuts.cend(), wanted,
                                 [](const Cut& cut, std::uint64_t before) { return cut.before < before; });
    if (best == cuts.cend() || (best != rest && wanted - std::prev(best)->before < best->before - wanted)) --best;
    begins.push_back(best->key);
    rest = std::next(best);
  }
  begins.resize(ranks + std::size_t{1}, Chunks::kEndOfWorld);
  return begins;
}

std::size_t rankOf(const std::vector<MortonKey>& begins, MortonKey key) {
  return static_cast<std::size_t>(std::upper_bound(begins.begin(), begins.end(), key) - begins.begin()) - 1;
}

void writeKey(ByteWriter& out, const BlockKey& key) {
  out.key(key.low);
  out.u8(static_cast<std::uint8_t>(key.depth));
}

}  // namespace

RankSteps::Totals RankSteps::total(const CellIntake& intake) {
  ByteWriter mine;
  mine.u64(intake.records().size());
  mine.u64(intake.segments());
  mine.box(intake.bounds());
  Totals totals;
  std::uint64_t cells = 0;
  unsigned rank = 0;
  for (const Bytes& bytes : ranks_.share(mine.bytes())) {
    ByteReader in(bytes);
    if (rank++ == ranks_.rank()) totals.first_cell = static_cast<std::uint32_t>(cells);
    cells += in.u64();
    totals.segments += in.u64();
    const GridBox box = in.box();
    if (!box.empty()) totals.bounds.extend(box);
  }
  if (cells > kMostCells) throw InputError("more than 2^32 - 2 cells: split the input into several sets");
  return totals;
}

void RankSteps::gatherCells(CellIntake& intake) {
  std::vector<ByteChain> outgoing = chainsForRanks(ranks_, spool_);
  if (!isFirst()) intake.handOver(outgoing[0]);
  std::vector<ByteChain> arrived = exchangeBytes(ranks_, outgoing, spool_);
  if (isFirst())
    for (ByteChain& cells : arrived) intake.take(cells);
}

void RankSteps::distribute(Chunks& read, Chunks& own, std::uint32_t first_cell, std::uint32_t capacity,
                           const std::function<void(std::uint64_t moved)>& progress) {
  constexpr std::uint64_t kSegmentsBetweenCalls = 65536;
  ByteWriter mine;
  for (const Chunks::Step& step : read.outline(capacity, kStepsOfOutline)) {
    mine.key(step.key);
    mine.u64(step.count);
    mine.u8(step.may_cut ? 1 : 0);
  }
  std::vector<Chunks::Step> outlines;
  for (const Bytes& bytes : ranks_.share(mine.bytes()))
    for (ByteReader in(bytes); in.left() > 0;) {
      const MortonKey key = in.key();
      const std::uint64_t count = in.u64();
      outlines.push_back({key, count, in.u8() != 0});
    }
  const std::vector<MortonKey> begins = rangesOf(std::move(outlines), ranks_.count());
  own.confine(begins[ranks_.rank()], begins[ranks_.rank() + 1]);
  std::vector<SegmentChain> outgoing = segmentsForRanks(ranks_, spool_);
  std::uint64_t moved = 0;
  std::size_t to = 0;
  bool of_one = false;  // the whole block goes to one rank
  read.drain(
      [&](const BlockKey& block) {
        to = rankOf(begins, block.low);
        of_one = to == rankOf(begins, block.high());
      },
      [&](SegmentRecord record) {
        if (++moved % kSegmentsBetweenCalls == 0) progress(moved);
        record.id.cell += first_cell;
        if (!of_one) to = rankOf(begins, mortonKey(midpoint(record.child, record.parent)));
        if (to == ranks_.rank())
          own.add(record);
        else
          outgoing[to].add(record);
      });
  exchangeSegments(ranks_, outgoing, [&](const SegmentRecord& record) {
    if (++moved % kSegmentsBetweenCalls == 0) progress(moved);
    own.add(record);
  });
}

std::vector<BlockKey> RankSteps::shareLeaves(const std::vector<BlockKey>& leaves,
                                             std::vector<std::uint32_t>& midpoints) {
  ByteWriter mine;
  for (std::size_t i = 0; i < leaves.size(); ++i) {
    writeKey(mine, leaves[i]);
    mine.u32(midpoints[i]);
  }
  std::vector<BlockKey> all;
  midpoints.clear();
  first_leaf_.clear();
  for (const Bytes& bytes : ranks_.share(mine.bytes())) {
    first_leaf_.push_back(static_cast<std::uint32_t>(all.size()));
    for (ByteReader in(bytes); in.left() > 0;) {
      const MortonKey low = in.key();
      const int depth = in.u8();
      all.push_back({low, depth});
      midpoints.push_back(in.u32());
    }
  }
  first_leaf_.push_back(static_cast<std::uint32_t>(all.size()));
  return all;
}

std::pair<std::size_t, std::size_t> RankSteps::addOtherChunks(std::vector<Chunk>& chunks) {
  std::vector<Chunk> own = std::move(chunks);
  chunks.clear();
  std::pair<std::size_t, std::size_t> range;
  for (unsigned rank = 0; rank < ranks_.count(); ++rank) {
    const std::uint32_t first = first_leaf_[rank], end = first_leaf_[rank + 1];
    if (rank == ranks_.rank()) {
      range.first = chunks.size();
      for (Chunk& chunk : own) {
        chunk.first_leaf += first;
        chunk.end_leaf += first;
        chunks.push_back(std::move(chunk));
      }
      range.second = chunks.size();
    } else if (first < end) {
      chunks.push_back({{}, {}, SegmentChain(spool_), SegmentChain(spool_), first, end});
    }
  }
  return range;
}

LandmarkSurvey RankSteps::shareSurvey(const LandmarkSurvey& survey) {
  LandmarkSurvey all;
  for (const Bytes& bytes : ranks_.share(survey.encode())) all.add(LandmarkSurvey::decode(bytes));
  return all;
}

void RankSteps::exchangeGhosts(std::vector<Chunk>& chunks, SegmentChain& arrived) {
  std::vector<SegmentChain> outgoing = segmentsForRanks(ranks_, spool_);
  for (Chunk& chunk : chunks)
    for (unsigned rank = 0; rank < ranks_.count(); ++rank)
      if (rank != ranks_.rank() && first_leaf_[rank] <= chunk.first_leaf && chunk.first_leaf < first_leaf_[rank + 1])
        outgoing[rank].take(chunk.ghosts);
  exchangeSegments(ranks_, outgoing, [&arrived](const SegmentRecord& record) { arrived.add(record); });
  arrived.close();
}

void RankSteps::gatherLong(std::vector<SegmentChain>& long_segments) {
  std::vector<SegmentChain> outgoing = segmentsForRanks(ranks_, spool_);
  if (!isLast())
    for (SegmentChain& chain : long_segments) outgoing.back().take(chain);
  exchangeSegments(ranks_, outgoing,
                   [&long_segments](const SegmentRecord& record) { long_segments.front().add(record); });
}

void RankSteps::gatherFound(std::vector<ByteChain>& pairs, std::vector<LandmarkChooser::Part>& parts,
                            const std::function<void(std::uint32_t cell, std::uint32_t leaf)>& use) {
  const auto number = [](std::uint64_t value) {
    ByteWriter out;
    out.u64(value);
    return out.take();
  };
  std::vector<ByteChain> outgoing = chainsForRanks(ranks_, spool_);
  if (!isFirst()) {
    outgoing[0].append(number(parts.size()));
    for (const LandmarkChooser::Part& part : parts) {
      const Bytes bytes = part.encode();
      outgoing[0].append(number(bytes.size()));
      outgoing[0].append(bytes);
    }
    parts.clear();
    for (ByteChain& chain : pairs) {
      chain.close();
      ByteChain::Reader reader(chain, true);
      for (ByteSpan block; !(block = reader.next()).empty();) outgoing[0].append(block);
    }
  }
  std::vector<ByteChain> arrived = exchangeBytes(ranks_, outgoing, spool_);
  if (!isFirst()) return;
  for (unsigned rank = 1; rank < ranks_.count(); ++rank) {
    std::uint64_t left = arrived[rank].bytes();
    ByteChain::Reader reader(arrived[rank], true);
    const auto read = [&](std::size_t n) {
      Bytes bytes(n);
      reader.read(bytes.data(), n);
      left -= n;
      return bytes;
    };
    for (std::uint64_t n = ByteReader(read(8)).u64(); n > 0; --n)
      parts.push_back(LandmarkChooser::Part::decode(read(ByteReader(read(8)).u64())));
    Bytes pair(8);
    for (; left > 0; left -= pair.size()) {
      reader.read(pair.data(), pair.size());
      ByteReader in(pair);
      const std::uint32_t cell = in.u32();
      use(cell, in.u32());
    }
  }
}

}  // namespace filiform::internal
