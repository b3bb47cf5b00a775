// ThreadRanks: ranks that are threads of one process (index/ranks/ranks.h). Thread rule: each object on its own thread.
#pragma once

#include "index/ranks/ranks.h"

#include <condition_variable>
#include <exception>
#include <functional>
#include <mutex>
#include <optional>
#include <thread>
#include <utility>
#include <vector>

namespace filiform::test {

class ThreadRanks final : public Ranks {
 public:
  struct Job {
    explicit Job(unsigned ranks) : count(ranks), given(ranks), pieces(ranks, std::vector<Bytes>(ranks)) {}
    const unsigned count;
    std::mutex mutex;
    std::condition_variable changed;
    unsigned arrived = 0;
    std::uint64_t turn = 0;
    std::vector<Bytes> given, shared;
    std::vector<std::vector<Bytes>> pieces;  // by sender, then by receiver
    std::optional<std::pair<unsigned, std::string>> failed;
    bool known = false;  // to all ranks
  };
  ThreadRanks(Job& job, unsigned rank) : job_(job), rank_(rank) {}

  unsigned rank() const override { return rank_; }
  unsigned count() const override { return job_.count; }
  std::vector<Bytes> share(std::span<const std::uint8_t> mine) override {
    std::vector<Bytes> all = meet({mine.begin(), mine.end()});
    if (known_) throw RankFailed(job_.failed->first, job_.failed->second);
    return all;
  }
  void exchange(const Send& send, const Take& take) override {
    std::vector<bool> ended(job_.count, false);
    for (;;) {
      std::uint8_t more = 0;
      for (unsigned to = 0; to < job_.count; ++to) {
        Bytes piece;
        if (to != rank_ && !ended[to]) ended[to] = !send(to, piece);
        more |= piece.empty() ? 0 : 1;
        job_.pieces[rank_][to] = std::move(piece);
      }
      bool any = false;
      for (const Bytes& word : share({&more, 1})) any = any || word.front() != 0;
      if (!any) return;
      for (unsigned from = 0; from < job_.count; ++from)
        if (const Bytes& piece = job_.pieces[from][rank_]; !piece.empty()) take(from, piece);
      share({});
    }
  }
  std::size_t piece_bytes() const override { return 1000; }
  void setFolder(const std::string&) override {}
  void fail(const std::exception& error) override {
    if (known_) return;
    {
      const std::lock_guard lock(job_.mutex);
      if (!job_.failed) job_.failed.emplace(rank_, error.what());
    }
    meet({});
  }

 private:
  std::vector<Bytes> meet(Bytes mine) {
    std::unique_lock lock(job_.mutex);
    job_.given[rank_] = std::move(mine);
    const std::uint64_t turn = job_.turn;
    if (++job_.arrived == job_.count) {
      job_.shared = job_.given;
      job_.known = job_.failed.has_value();
      job_.arrived = 0;
      ++job_.turn;
      job_.changed.notify_all();
    } else {
      job_.changed.wait(lock, [&] { return job_.turn != turn; });
    }
    known_ = job_.known;
    return job_.shared;
  }

  Job& job_;
  unsigned rank_;
  bool known_ = false;  // that a rank has failed
};

// Runs work(ranks) on one thread for each rank. Returns the exceptions, by rank.
inline std::vector<std::exception_ptr> onRanks(unsigned count, const std::function<void(Ranks& ranks)>& work) {
  ThreadRanks::Job job(count);
  std::vector<std::exception_ptr> thrown(count);
  {
    std::vector<std::jthread> threads;
    for (unsigned rank = 0; rank < count; ++rank)
      threads.emplace_back([&, rank] {
        ThreadRanks ranks(job, rank);
        try {
          work(ranks);
        } catch (const std::exception& error) {
          thrown[rank] = std::current_exception();
          ranks.fail(error);
        }
      });
  }
  return thrown;
}

}  // namespace filiform::test
