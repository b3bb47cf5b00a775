// SetShelf: the sets that the service offers, by name, each in its current revision.
//
//   SetShelf shelf({"column.fil"}, 256 << 20);
//   if (const auto served = shelf.find("column")) served->nearest().find(p_W);
//
// A request keeps the revision that find() gave it, also if another is published meanwhile.
// Thread rule: internally synchronised.
#pragma once

#include "index/file/tile_source.h"
#include "tools/serve/sets/served_set.h"

#include <chrono>
#include <cstdint>
#include <memory>
#include <mutex>
#include <string>
#include <vector>

namespace filiform::tools {

class SetShelf {
 public:
  // Opens the sets, folders or addresses, each with an equal part of the budget. A set's name is that of its folder
  // without `.fil`. Throws UsageError if two sets have the same name or a name is empty; also as TileSet::open() does.
  SetShelf(const std::vector<std::string>& paths, std::uint64_t budget_bytes, const RemoteOptions& remote = {});

  // In the order of the paths.
  std::vector<std::shared_ptr<const ServedSet>> all() const;
  std::shared_ptr<const ServedSet> find(const std::string& name) const;  // nullptr: there is none
  // The revision of a set, also one of the last two before the current one; nullptr if the shelf has it not.
  std::shared_ptr<const TileSet> revision(const std::string& name, const std::string& revision) const;

  // Reads CURRENT of each set, of one at an address every ten seconds, and opens newer revisions. A set that cannot be
  // opened keeps its revision. Returns one line for each set that could not be read. One thread at a time. O(sets),
  // plus opening.
  std::vector<std::string> refresh();
  // The lines of the last refresh().
  std::vector<std::string> problems() const;

 private:
  struct Slot {
    std::string path;
    std::shared_ptr<const TileSource> watched;  // of a set at an address
    std::shared_ptr<const ServedSet> current;
    std::vector<std::shared_ptr<const TileSet>> older{};  // latest first
    std::chrono::steady_clock::time_point next_look{};    // of a set at an address
    std::string problem{};                                // of its last look
  };
  static constexpr std::size_t kOlder = 2;

  std::uint64_t budget_bytes_;  // of one set
  RemoteOptions remote_;
  mutable std::mutex mutex_;
  std::vector<Slot> slots_;
  std::vector<std::string> problems_;
};

}  // namespace filiform::tools
