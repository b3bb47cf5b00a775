#include "index/ingest/ranks/internal/rank_streams.h"

#include <deque>
#include <utility>

namespace filiform::internal {
namespace {

constexpr std::size_t kLengthBytes = 4;

std::deque<ByteChain::Reader> readersOf(std::vector<ByteChain*> chains) {
  std::deque<ByteChain::Reader> readers;
  for (ByteChain* chain : chains) {
    chain->close();
    readers.emplace_back(*chain, true);
  }
  return readers;
}

}  // namespace

std::vector<ByteChain> chainsForRanks(const Ranks& ranks, Spool& spool) {
  std::vector<ByteChain> chains;
  for (unsigned i = 0; i < ranks.count(); ++i) chains.emplace_back(spool);
  return chains;
}

std::vector<SegmentChain> segmentsForRanks(const Ranks& ranks, Spool& spool) {
  std::vector<SegmentChain> chains;
  for (unsigned i = 0; i < ranks.count(); ++i) chains.emplace_back(spool);
  return chains;
}

std::vector<ByteChain> exchangeBytes(Ranks& ranks, std::vector<ByteChain>& outgoing, Spool& spool) {
  std::vector<ByteChain> arrived = chainsForRanks(ranks, spool);
  std::vector<ByteChain*> chains;
  for (ByteChain& chain : outgoing) chains.push_back(&chain);
  arrived[ranks.rank()].take(outgoing[ranks.rank()]);
  std::deque<ByteChain::Reader> readers = readersOf(chains);
  ranks.exchange(
      [&](unsigned to, Ranks::Bytes& piece) {
        for (ByteSpan block; piece.size() < ranks.piece_bytes() && !(block = readers[to].next()).empty();)
          piece.insert(piece.end(), block.begin(), block.end());
        return !piece.empty();
      },
      [&](unsigned from, ByteSpan piece) { arrived[from].append(piece); });
  for (ByteChain& chain : arrived) chain.close();
  return arrived;
}

// A piece: blocks, each after its length; then the bytes that a reader of blocks may load.
void exchangeSegments(Ranks& ranks, std::vector<SegmentChain>& outgoing,
                      const std::function<void(const SegmentRecord& record)>& use) {
  std::vector<ByteChain*> chains;
  for (SegmentChain& chain : outgoing) chains.push_back(&chain.bytes_chain());
  std::deque<ByteChain::Reader> readers = readersOf(chains);
  ranks.exchange(
      [&](unsigned to, Ranks::Bytes& piece) {
        for (ByteSpan block; piece.size() < ranks.piece_bytes() && !(block = readers[to].next()).empty();) {
          ByteWriter length;
          length.u32(static_cast<std::uint32_t>(block.size()));
          piece.insert(piece.end(), length.bytes().begin(), length.bytes().end());
          piece.insert(piece.end(), block.begin(), block.end());
        }
        if (piece.empty()) return false;
        piece.resize(piece.size() + Spool::kSlack);
        return true;
      },
      [&](unsigned, ByteSpan piece) {
        for (piece = piece.first(piece.size() - Spool::kSlack); !piece.empty();) {
          const std::size_t length = ByteReader(piece.first(kLengthBytes)).u32();
          SegmentChain::forEach(piece.subspan(kLengthBytes, length), use);
          piece = piece.subspan(kLengthBytes + length);
        }
      });
}

}  // namespace filiform::internal
