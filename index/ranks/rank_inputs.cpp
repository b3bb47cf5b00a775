#include "index/ranks/rank_inputs.h"

#include "index/errors.h"
#include "index/text.h"

#include <algorithm>
#include <map>
#include <string>
#include <utility>

#include <nlohmann/json.hpp>

namespace filiform::tools {

using nlohmann::json;

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
  const std::vector<std::string_view> sources = input_.sources();
  const std::vector<std::uint64_t> sizes = input_.sizes();
  json list = json::array();
  for (std::size_t i = 0; i < sources.size(); ++i) list.push_back({std::string(sources[i]), sizes[i]});
  const Ranks::Bytes mine = json::to_cbor(list);
  const std::vector<Ranks::Bytes> all = ranks_.share(mine);
  for (unsigned r = 0; r < ranks_.count(); ++r) {
    if (all[r] == mine) continue;
    std::map<std::string, std::uint64_t> own;
    for (std::size_t i = 0; i < sources.size(); ++i) own.emplace(sources[i], sizes[i]);
    for (const json& there : json::from_cbor(all[r])) {
      const auto source = there[0].get<std::string>();
      const auto size = there[1].get<std::uint64_t>();
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
  const std::vector<Input::Unreadable> unreadable = input_.unreadable();
  json mine = json::array();
  for (const Input::Unreadable& input : unreadable)
    mine.push_back({input.row, input.entry, input.source, input.reason});
  const std::vector<Ranks::Bytes> lists = ranks_.share(json::to_cbor(mine));
  json readable = json::array();  // of other ranks' lists: rank and position
  for (unsigned r = 0; r < ranks_.count(); ++r) {
    std::uint64_t position = 0;
    for (const json& there : json::from_cbor(lists[r])) {
      const std::uint64_t at = position++;
      const Input::Unreadable input{there[0].get<std::uint32_t>(), there[1].get<std::uint32_t>(),
                                    there[2].get<std::string>(), there[3].get<std::string>()};
      const auto same = [&](const Input::Unreadable& own) { return own.row == input.row && own.entry == input.entry; };
      if (r == ranks_.rank() || std::any_of(unreadable.begin(), unreadable.end(), same)) continue;
      if (input_.tryToRead(input)) continue;
      readable.push_back({r, at});
    }
  }
  const std::vector<Ranks::Bytes> found = ranks_.share(json::to_cbor(readable));
  for (unsigned r = 0; r < ranks_.count(); ++r)
    for (const json& there : json::from_cbor(found[r])) {
      if (there[0] != ranks_.rank()) continue;
      const Input::Unreadable& input = unreadable.at(there[1].get<std::size_t>());
      throw IoError(escaped(input.source, 300), input.reason + "; rank " + std::to_string(r) + " can read it");
    }
  ranks_.share({});
}

void RankInputs::gather(AttributedCells* attributed) {
  compareReadable();
  const std::vector<Ranks::Bytes> reports = toFirst(ranks_, input_.encodeReports());
  const std::vector<Ranks::Bytes> placed =
      toFirst(ranks_, placed_ != nullptr ? placed_->encodeReport() : Ranks::Bytes{});
  const std::vector<Ranks::Bytes> counts =
      toFirst(ranks_, attributed != nullptr ? attributed->encodeCounts() : Ranks::Bytes{});
  if (ranks_.rank() != 0) return;
  for (unsigned r = 1; r < ranks_.count(); ++r) input_.takeReports(reports[r]);
  if (placed_ != nullptr) placed_->takeReports(placed);
  if (attributed != nullptr) attributed->takeCounts(counts);
}

}  // namespace filiform::tools
