// MpiRanks: the ranks of an MPI job (index/ranks/ranks.h). Thread rule: thread-compatible, on the thread that made it.
//
// Each call begins with a word of every rank: it goes on, or it has failed. So a rank that fails never leaves others
// waiting. Waiting ranks sleep between looks, since MPI itself would keep a core busy.
#pragma once

#include "index/ranks/ranks.h"

#include <chrono>
#include <cstdint>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <vector>

namespace filiform::tools {

class MpiRanks final : public Ranks {
 public:
  enum class Exchange : std::uint8_t { network, files };

  // Starts MPI, and ends it. One object a process.
  MpiRanks();
  MpiRanks(const MpiRanks&) = delete;
  MpiRanks& operator=(const MpiRanks&) = delete;
  ~MpiRanks() override;

  void setExchange(Exchange exchange) { exchange_ = exchange; }

  unsigned rank() const override { return rank_; }
  unsigned count() const override { return count_; }
  std::vector<Bytes> share(std::span<const std::uint8_t> mine) override;
  void exchange(const Send& send, const Take& take) override;
  std::size_t piece_bytes() const override;
  void setFolder(const std::string& folder) override { folder_ = folder; }
  Amount progress(std::string_view step, Amount own) override;

  struct Failure {
    unsigned rank;  // the lowest that failed
    int exit_code;
    std::string why;
    bool everywhere;  // every rank failed for this reason
  };
  void fail(const std::exception& error) override;
  const std::optional<Failure>& failure() const { return failure_; }  // of any rank
  // Call it last on every rank, with the exit code of this one: a rank may have failed after its last call.
  void end(int exit_code);

 private:
  struct Word {                   // of a rank, at the beginning of each call
    std::uint64_t failed, value;  // `value` of a rank that failed: a hash of the reason
  };
  std::vector<Word> agree(Word mine);
  [[noreturn]] void throwFailure(const std::vector<Word>& words);
  Failure learn(const std::vector<Word>& words, int exit_code, const std::string& why);
  void exchangeOverNetwork(const Send& send, const Take& take);
  void exchangeOverFiles(const Send& send, const Take& take);
  std::string fileOf(unsigned from, unsigned to) const;

  unsigned rank_ = 0, count_ = 1;
  Exchange exchange_ = Exchange::network;
  std::string folder_;
  std::uint64_t exchanges_ = 0;
  struct Note {  // progress, for rank 0
    std::uint64_t step, done, total;
  };
  void takeNotes();
  struct Sending;
  std::unique_ptr<Sending> sending_;  // a note under way to rank 0
  std::uint64_t notes_ = 0;           // sent
  std::chrono::steady_clock::time_point noted_;
  std::map<std::uint64_t, std::vector<Amount>> amounts_;  // on rank 0: by step, then by rank
  std::vector<std::uint64_t> taken_;                      // on rank 0: notes of each rank
  std::optional<Failure> failure_;
};

}  // namespace filiform::tools
