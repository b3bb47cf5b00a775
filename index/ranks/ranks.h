// Ranks: processes that do one work together, on one machine or on several with a common file system: they make a set,
// check inputs, or search for points. tools/mpi implements this interface with MPI. Ranks have the numbers 0 ..
// count() - 1.
//
// share() and exchange() are calls of all ranks together: each rank makes the same calls in the same order, and waits
// in them for the others. A rank that fails calls fail() instead of its next call. The others then throw RankFailed.
// ingest() calls fail() for what it throws; its caller does so for its own failures.
#pragma once

#include "index/errors.h"

#include <cstddef>
#include <cstdint>
#include <exception>
#include <functional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

namespace filiform {

// Another rank failed and has reported why.
class RankFailed : public Error {
 public:
  RankFailed(unsigned rank, const std::string& why) : Error("rank " + std::to_string(rank) + ": " + why), rank_(rank) {}
  unsigned rank() const { return rank_; }

 private:
  unsigned rank_;
};

// Thread rule: thread-compatible; all members on the thread that made it.
class Ranks {
 public:
  using Bytes = std::vector<std::uint8_t>;

  virtual ~Ranks() = default;
  virtual unsigned rank() const = 0;
  virtual unsigned count() const = 0;

  // Passes `mine` to every rank. Returns the bytes of all ranks, by rank. Throws RankFailed, IoError.
  virtual std::vector<Bytes> share(std::span<const std::uint8_t> mine) = 0;

  // Passes pieces from every rank to every other rank. Pieces of one sender arrive in their order. Calls `send` for
  // each other rank until it returns false: it fills the empty `piece` with at least one byte and about piece_bytes().
  // Calls `take` for each piece that arrives. Holds two pieces for each other rank. Throws RankFailed, IoError, and
  // what `send` and `take` throw.
  using Send = std::function<bool(unsigned to, Bytes& piece)>;
  using Take = std::function<void(unsigned from, std::span<const std::uint8_t> piece)>;
  virtual void exchange(const Send& send, const Take& take) = 0;
  virtual std::size_t piece_bytes() const = 0;

  // Tells the other ranks that this one failed. Returns when all ranks know; so none of them is at work any more.
  // Does nothing after a first failure of any rank.
  virtual void fail(const std::exception& error) = 0;

  // Progress of a step on this rank. On rank 0, returns the sums of what is known of all ranks; elsewhere, what was
  // given. Never waits.
  struct Amount {
    std::uint64_t done, total;
  };
  virtual Amount progress(std::string_view /*step*/, Amount own) { return own; }

  // Where exchange() may keep files; it removes them. Every rank sets the same folder before its first exchange().
  virtual void setFolder(const std::string& folder) = 0;
};

// Passes to[r] to each rank r by exchange(): a call of all ranks together. Requires count() elements. Returns the bytes
// from each rank, by rank; its own unchanged. Throws as exchange() does.
std::vector<Ranks::Bytes> passAll(Ranks& ranks, std::vector<Ranks::Bytes> to);
// Passes bytes to rank 0 in this way. Returns there the bytes of all ranks, by rank; elsewhere, empty ones.
std::vector<Ranks::Bytes> toFirst(Ranks& ranks, Ranks::Bytes mine);

}  // namespace filiform
