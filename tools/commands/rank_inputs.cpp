#include "tools/commands/rank_inputs.h"

#include "index/errors.h"
#include "index/text.h"

#include <algorithm>
#include <map>
#include <string>
#include <utility>

namespace filiform::tools {
namespace {

void put(Ranks::Bytes& out, std::uint64_t value) {
  for (int i = 0; i < 8; ++i) out.push_back(static_cast<std::uint8_t>(value >> (8 * i)));
}

void put(Ranks::Bytes& out, std::string_view text) {
  put(out, text.size());
  out.insert(out.end(), text.begin(), text.end());
}

class Values {
 public:
  explicit Values(const Ranks::Bytes& bytes) : bytes_(bytes) {}
  bool ended() const { return at_ == bytes_.size(); }
  std::uint64_t number() {
    std::uint64_t value = 0;
    for (int i = 0; i < 8; ++i) value |= std::uint64_t{bytes_.at(at_++)} << (8 * i);
    return value;
  }
  std::string text() {
    const std::size_t size = number();
    const std::string text(bytes_.begin() + static_cast<std::ptrdiff_t>(at_),
                           bytes_.begin() + static_cast<std::ptrdiff_t>(at_ + size));
    at_ += size;
    return text;
  }

 private:
  const Ranks::Bytes& bytes_;
  std::size_t at_ = 0;
};

}  // namespace

RankInputs::RankInputs(Ranks& ranks, Input& input, PlacedCells* placed, CircuitCells* circuit)
    : ranks_(ranks), input_(input), placed_(circuit != nullptr ? &circuit->placed() : placed) {
  compareLists();
  if (circuit != nullptr)
    circuit->keepPart(ranks_.rank(), ranks_.count());
  else if (placed_ != nullptr)
    placed_->keepPart(ranks_.rank(), ranks_.count());
  else
    input_.keepPart(ranks_.rank(), ranks_.count());
}

// Ranks whose lists differ do not see the same files. Names the first input that is missing here, or that only this
// rank cannot read.
void RankInputs::compareLists() {
  Ranks::Bytes mine;
  const std::vector<std::string_view> sources = input_.sources();
  const std::vector<std::uint64_t> sizes = input_.sizes();
  for (std::size_t i = 0; i < sources.size(); ++i) {
    put(mine, sources[i]);
    put(mine, sizes[i]);
  }
  const std::vector<Ranks::Bytes> all = ranks_.share(mine);
  for (unsigned r = 0; r < ranks_.count(); ++r) {
    if (all[r] == mine) continue;
    std::map<std::string, std::uint64_t> own;
    for (std::size_t i = 0; i < sources.size(); ++i) own.emplace(sources[i], sizes[i]);
    for (Values there(all[r]); !there.ended();) {
      const std::string source = there.text();
      const std::uint64_t size = there.number();
      const auto found = own.find(source);
      if (found != own.end() && (found->second == size || r > ranks_.rank())) continue;
      std::string why = found != own.end() ? "has another size than on rank " + std::to_string(r)
                                           : "is missing here; rank " + std::to_string(r) + " has it";
      for (const Input::Unreadable& input : input_.unreadable())
        if (input.source == source) why = input.reason + "; rank " + std::to_string(r) + " can read it";
      throw IoError(escaped(source, 300), why);
    }
  }
  // Another rank has found that it lacks an input.
  ranks_.share({});
}

void RankInputs::compareReadable() {
  Ranks::Bytes mine;
  const std::vector<Input::Unreadable> unreadable = input_.unreadable();
  for (const Input::Unreadable& input : unreadable) {
    put(mine, input.row);
    put(mine, input.entry);
    put(mine, input.source);
    put(mine, input.reason);
  }
  const std::vector<Ranks::Bytes> lists = ranks_.share(mine);
  Ranks::Bytes readable;  // of other ranks' lists: rank and position
  for (unsigned r = 0; r < ranks_.count(); ++r) {
    std::uint64_t position = 0;
    for (Values there(lists[r]); !there.ended(); ++position) {
      Input::Unreadable input;
      input.row = static_cast<std::uint32_t>(there.number());
      input.entry = static_cast<std::uint32_t>(there.number());
      input.source = there.text();
      input.reason = there.text();
      const auto same = [&](const Input::Unreadable& own) { return own.row == input.row && own.entry == input.entry; };
      if (r == ranks_.rank() || std::any_of(unreadable.begin(), unreadable.end(), same)) continue;
      if (input_.tryToRead(input)) continue;
      put(readable, r);
      put(readable, position);
    }
  }
  const std::vector<Ranks::Bytes> found = ranks_.share(readable);
  for (unsigned r = 0; r < ranks_.count(); ++r)
    for (Values there(found[r]); !there.ended();) {
      const std::uint64_t rank = there.number(), position = there.number();
      if (rank != ranks_.rank()) continue;
      const Input::Unreadable& input = unreadable.at(position);
      throw IoError(escaped(input.source, 300), input.reason + "; rank " + std::to_string(r) + " can read it");
    }
  ranks_.share({});
}

std::vector<Ranks::Bytes> RankInputs::toFirst(Ranks::Bytes mine) {
  std::vector<Ranks::Bytes> all(ranks_.count());
  std::size_t at = 0;
  ranks_.exchange(
      [&](unsigned to, Ranks::Bytes& piece) {
        const std::size_t n = to == 0 ? std::min(mine.size() - at, ranks_.piece_bytes()) : 0;
        piece.assign(mine.begin() + static_cast<std::ptrdiff_t>(at),
                     mine.begin() + static_cast<std::ptrdiff_t>(at + n));
        at += n;
        return n > 0;
      },
      [&](unsigned from, std::span<const std::uint8_t> piece) {
        all[from].insert(all[from].end(), piece.begin(), piece.end());
      });
  all[ranks_.rank()] = std::move(mine);
  return all;
}

void RankInputs::gather(AttributedCells* attributed) {
  compareReadable();
  const std::vector<Ranks::Bytes> reports = toFirst(input_.encodeReports());
  const std::vector<Ranks::Bytes> placed = toFirst(placed_ != nullptr ? placed_->encodeReport() : Ranks::Bytes{});
  const std::vector<Ranks::Bytes> counts = toFirst(attributed != nullptr ? attributed->encodeCounts() : Ranks::Bytes{});
  if (ranks_.rank() != 0) return;
  for (unsigned r = 1; r < ranks_.count(); ++r) input_.takeReports(reports[r]);
  if (placed_ != nullptr) placed_->takeReports(placed);
  if (attributed != nullptr) attributed->takeCounts(counts);
}

}  // namespace filiform::tools
