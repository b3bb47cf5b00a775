#include "tools/mpi/mpi_ranks.h"

#include "index/errors.h"
#include "tools/program/interruption.h"

#include <algorithm>
#include <cerrno>
#include <chrono>
#include <csignal>
#include <cstdio>
#include <fstream>
#include <functional>
#include <mpi.h>
#include <thread>
#include <utility>

#include <climits>

namespace filiform::tools {
namespace {

constexpr std::size_t kLeastPiece = std::size_t{64} << 10, kMostPiece = std::size_t{1} << 20;
constexpr std::size_t kPieces = std::size_t{4} << 20;   // of all ranks, in one direction
constexpr std::size_t kShared = std::size_t{64} << 20;  // bytes of one call of MPI, of all ranks
constexpr int kTag = 1, kNoteTag = 2;
constexpr std::chrono::milliseconds kBetweenNotes{200};

void wait(std::vector<MPI_Request>& requests) {
  using namespace std::chrono_literals;
  std::chrono::microseconds pause = 0us;
  for (int done = 0;;) {
    MPI_Testall(static_cast<int>(requests.size()), requests.data(), &done, MPI_STATUSES_IGNORE);
    if (done != 0) break;
    if (pause == 0us)
      std::this_thread::yield();
    else
      std::this_thread::sleep_for(pause);
    pause = std::min<std::chrono::microseconds>(pause + 5us, 1000us);
  }
  requests.clear();
}

void wait(MPI_Request request) {
  std::vector<MPI_Request> one{request};
  wait(one);
}

void broadcast(void* bytes, std::size_t size, unsigned from) {
  MPI_Request request;
  MPI_Ibcast(bytes, static_cast<int>(size), MPI_BYTE, static_cast<int>(from), MPI_COMM_WORLD, &request);
  wait(request);
}

int exitCodeOf(const std::exception& error) {
  if (dynamic_cast<const Interrupted*>(&error) != nullptr) return interruptedExitCode();
  if (dynamic_cast<const ClosedPipe*>(&error) != nullptr) return 128 + SIGPIPE;
  if (dynamic_cast<const UsageError*>(&error) != nullptr) return 2;
  const bool of_system = dynamic_cast<const IoError*>(&error) != nullptr;
  return dynamic_cast<const Error*>(&error) != nullptr && !of_system ? 1 : 3;
}

}  // namespace

struct MpiRanks::Sending {
  Note note;
  MPI_Request request;
};

MpiRanks::MpiRanks() {
  int provided = 0, rank = 0, count = 1;
  MPI_Init_thread(nullptr, nullptr, MPI_THREAD_FUNNELED, &provided);
  MPI_Comm_rank(MPI_COMM_WORLD, &rank);
  MPI_Comm_size(MPI_COMM_WORLD, &count);
  rank_ = static_cast<unsigned>(rank);
  count_ = static_cast<unsigned>(count);
  taken_.resize(count_);
}

MpiRanks::~MpiRanks() { MPI_Finalize(); }

std::vector<MpiRanks::Word> MpiRanks::agree(Word mine) {
  std::vector<Word> words(count_);
  MPI_Request request;
  MPI_Iallgather(&mine, 2, MPI_UINT64_T, words.data(), 2, MPI_UINT64_T, MPI_COMM_WORLD, &request);
  wait(request);
  return words;
}

MpiRanks::Failure MpiRanks::learn(const std::vector<Word>& words, int exit_code, const std::string& why) {
  const auto failed = [](const Word& word) { return word.failed != 0; };
  const auto lowest = std::find_if(words.begin(), words.end(), failed);
  const bool everywhere = std::all_of(
      words.begin(), words.end(), [&](const Word& word) { return failed(word) && word.value == words.front().value; });
  Failure failure{static_cast<unsigned>(lowest - words.begin()), exit_code, why, everywhere};
  std::uint64_t head[2] = {static_cast<std::uint64_t>(exit_code), why.size()};
  broadcast(head, sizeof head, failure.rank);
  failure.exit_code = static_cast<int>(head[0]);
  failure.why.resize(head[1]);
  broadcast(failure.why.data(), failure.why.size(), failure.rank);
  failure_ = failure;
  return failure;
}

void MpiRanks::throwFailure(const std::vector<Word>& words) {
  const Failure failure = learn(words, 0, {});
  throw RankFailed(failure.rank, failure.why);
}

void MpiRanks::fail(const std::exception& error) {
  if (failure_ || count_ == 1) return;
  const std::string why = error.what();
  learn(agree({1, std::hash<std::string>()(why)}), exitCodeOf(error), why);
}

void MpiRanks::end(int exit_code) {
  if (count_ == 1) return;
  if (!failure_) {
    const std::vector<Word> ends = agree({exit_code != 0 ? 1u : 0u, 0});
    if (std::any_of(ends.begin(), ends.end(), [](const Word& word) { return word.failed != 0; }))
      learn(ends, exit_code, "the command line was refused, or standard output cannot be written");
  }
  const std::vector<Word> words = agree({0, notes_});
  if (rank_ == 0)
    while (!std::equal(words.begin(), words.end(), taken_.begin(),
                       [](const Word& word, std::uint64_t taken) { return word.value == taken; }))
      takeNotes();
  if (sending_) wait(sending_->request);
}

Ranks::Amount MpiRanks::progress(std::string_view step, Amount own) {
  if (count_ == 1) return own;
  const std::uint64_t name = std::hash<std::string_view>()(step);
  if (rank_ == 0) {
    takeNotes();
    std::vector<Amount>& amounts = amounts_[name];
    amounts.resize(count_);
    amounts[0] = own;
    Amount all{0, 0};
    for (const Amount& amount : amounts) all.done += amount.done, all.total += amount.total;
    return all;
  }
  const auto now = std::chrono::steady_clock::now();
  if (now - noted_ < kBetweenNotes) return own;
  if (sending_) {
    int done = 0;
    MPI_Test(&sending_->request, &done, MPI_STATUS_IGNORE);
    if (done == 0) return own;
  }
  sending_ = std::make_unique<Sending>(Sending{{name, own.done, own.total}, MPI_REQUEST_NULL});
  MPI_Isend(&sending_->note, 3, MPI_UINT64_T, 0, kNoteTag, MPI_COMM_WORLD, &sending_->request);
  noted_ = now;
  ++notes_;
  return own;
}

void MpiRanks::takeNotes() {
  for (;;) {
    int there = 0;
    MPI_Status status;
    MPI_Iprobe(MPI_ANY_SOURCE, kNoteTag, MPI_COMM_WORLD, &there, &status);
    if (there == 0) return;
    Note note{};
    MPI_Recv(&note, 3, MPI_UINT64_T, status.MPI_SOURCE, kNoteTag, MPI_COMM_WORLD, MPI_STATUS_IGNORE);
    std::vector<Amount>& amounts = amounts_[note.step];
    amounts.resize(count_);
    amounts[static_cast<std::size_t>(status.MPI_SOURCE)] = {note.done, note.total};
    ++taken_[static_cast<std::size_t>(status.MPI_SOURCE)];
  }
}

std::vector<Ranks::Bytes> MpiRanks::share(std::span<const std::uint8_t> mine) {
  const std::vector<Word> words = agree({0, mine.size()});
  if (std::any_of(words.begin(), words.end(), [](const Word& word) { return word.failed != 0; })) throwFailure(words);
  std::vector<Bytes> all(count_);
  std::uint64_t most = 0;
  for (unsigned r = 0; r < count_; ++r) {
    all[r].resize(words[r].value);
    most = std::max(most, words[r].value);
  }
  const std::size_t step = std::max<std::size_t>(kShared / count_, 1);
  for (std::uint64_t at = 0; at < most; at += step) {
    const auto part = [&](std::uint64_t size) {
      return static_cast<int>(std::min<std::uint64_t>(size - std::min(size, at), step));
    };
    std::vector<int> sizes, places;
    int place = 0;
    for (unsigned r = 0; r < count_; ++r) {
      sizes.push_back(part(words[r].value));
      places.push_back(place);
      place += sizes.back();
    }
    Bytes got(static_cast<std::size_t>(place));
    MPI_Request request;
    MPI_Iallgatherv(mine.data() + std::min<std::uint64_t>(at, mine.size()), sizes[rank_], MPI_BYTE, got.data(),
                    sizes.data(), places.data(), MPI_BYTE, MPI_COMM_WORLD, &request);
    wait(request);
    for (unsigned r = 0; r < count_; ++r)
      std::copy_n(got.begin() + places[r], sizes[r],
                  all[r].begin() + static_cast<std::ptrdiff_t>(std::min<std::uint64_t>(at, all[r].size())));
  }
  return all;
}

std::size_t MpiRanks::piece_bytes() const {
  return std::clamp(kPieces / std::max(1u, count_ - 1), kLeastPiece, kMostPiece);
}

void MpiRanks::exchange(const Send& send, const Take& take) {
  if (exchange_ == Exchange::files)
    exchangeOverFiles(send, take);
  else
    exchangeOverNetwork(send, take);
}

// In rounds: one piece for each other rank.
void MpiRanks::exchangeOverNetwork(const Send& send, const Take& take) {
  std::vector<Bytes> out(count_), in(count_);
  std::vector<bool> ended(count_, false);
  std::vector<std::uint64_t> out_sizes(count_), in_sizes(count_);
  std::vector<MPI_Request> requests;
  for (;;) {
    std::uint64_t more = 0;
    for (unsigned r = 0; r < count_; ++r) {
      out[r].clear();
      if (r != rank_ && !ended[r]) ended[r] = !send(r, out[r]);
      if (ended[r]) out[r].clear();
      out_sizes[r] = out[r].size();
      more += out_sizes[r];
    }
    const std::vector<Word> words = agree({0, more});
    if (std::any_of(words.begin(), words.end(), [](const Word& word) { return word.failed != 0; })) throwFailure(words);
    if (std::all_of(words.begin(), words.end(), [](const Word& word) { return word.value == 0; })) return;
    MPI_Request request;
    MPI_Ialltoall(out_sizes.data(), 1, MPI_UINT64_T, in_sizes.data(), 1, MPI_UINT64_T, MPI_COMM_WORLD, &request);
    wait(request);
    for (unsigned r = 0; r < count_; ++r) {
      if (r == rank_) continue;
      in[r].resize(in_sizes[r]);
      if (in_sizes[r] > 0) {
        MPI_Irecv(in[r].data(), static_cast<int>(in[r].size()), MPI_BYTE, static_cast<int>(r), kTag, MPI_COMM_WORLD,
                  &request);
        requests.push_back(request);
      }
      if (out_sizes[r] > 0) {
        MPI_Isend(out[r].data(), static_cast<int>(out[r].size()), MPI_BYTE, static_cast<int>(r), kTag, MPI_COMM_WORLD,
                  &request);
        requests.push_back(request);
      }
    }
    wait(requests);
    for (unsigned r = 0; r < count_; ++r)
      if (r != rank_ && !in[r].empty()) take(r, in[r]);
  }
}

std::string MpiRanks::fileOf(unsigned from, unsigned to) const {
  return folder_ + "/exchange-" + std::to_string(exchanges_) + "-" + std::to_string(from) + "-" + std::to_string(to);
}

// Each rank writes a file for each other rank: pieces, each after its size.
void MpiRanks::exchangeOverFiles(const Send& send, const Take& take) {
  const auto failed = [](const std::string& path, const char* what) { return IoError(path, what, errno); };
  ++exchanges_;
  std::vector<std::uint8_t> has(count_, 0);
  for (unsigned to = 0; to < count_; ++to) {
    if (to == rank_) continue;
    std::ofstream file;
    for (Bytes piece; send(to, piece); piece.clear()) {
      if (has[to] == 0) file.open(fileOf(rank_, to), std::ios::binary | std::ios::trunc);
      has[to] = 1;
      const std::uint64_t size = piece.size();
      file.write(reinterpret_cast<const char*>(&size), sizeof size);
      file.write(reinterpret_cast<const char*>(piece.data()), static_cast<std::streamsize>(size));
      if (!file) throw failed(fileOf(rank_, to), "cannot be written");
    }
    if (has[to] != 0) file.close();
    if (!file) throw failed(fileOf(rank_, to), "cannot be written");
  }
  const std::vector<Bytes> all = share(has);
  for (unsigned from = 0; from < count_; ++from) {
    if (all[from][rank_] == 0) continue;
    const std::string path = fileOf(from, rank_);
    std::ifstream file(path, std::ios::binary);
    if (!file) throw failed(path, "written by another rank, cannot be read here; do all ranks see the same folder?");
    Bytes piece;
    for (std::uint64_t size; file.read(reinterpret_cast<char*>(&size), sizeof size);) {
      piece.resize(size);
      if (!file.read(reinterpret_cast<char*>(piece.data()), static_cast<std::streamsize>(size)))
        throw failed(path, "written by another rank, ends too early");
      take(from, piece);
    }
    file.close();
    std::remove(path.c_str());
  }
}

}  // namespace filiform::tools
