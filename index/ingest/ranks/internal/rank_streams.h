// Streams of bytes and segments between ranks, kept in spools at both ends. Thread rule: as Ranks.
#pragma once

#include "index/file/internal/spool.h"
#include "index/ranks/ranks.h"
#include "index/tile/internal/segment_chain.h"

#include <functional>
#include <vector>

namespace filiform::internal {

// One empty chain for each rank.
std::vector<ByteChain> chainsForRanks(const Ranks& ranks, Spool& spool);
std::vector<SegmentChain> segmentsForRanks(const Ranks& ranks, Spool& spool);

// Sends outgoing[to] to each other rank and frees it. Returns the bytes that arrived, by rank, in closed chains of
// `spool`; the bytes for the own rank are among them.
std::vector<ByteChain> exchangeBytes(Ranks& ranks, std::vector<ByteChain>& outgoing, Spool& spool);

// Sends outgoing[to] to each other rank and frees it. Calls `use` for each segment that arrives.
void exchangeSegments(Ranks& ranks, std::vector<SegmentChain>& outgoing,
                      const std::function<void(const SegmentRecord& record)>& use);

}  // namespace filiform::internal
