// SetShelf: the sets that the service offers, by name, each in its current revision.
//
//   SetShelf shelf(shelfEntries({"column.fil", "far=s3://sets/lab/column.fil"}), 256 << 20);
//   if (const auto served = shelf.find("column")) served->nearest().find(p_W);
//
// A request keeps the revision that find() gave it, also if another is published meanwhile.
// Thread rule: internally synchronised.
#pragma once

#include "index/file/tile_source.h"
#include "tools/serve/people/person.h"
#include "tools/serve/sets/served_set.h"

#include <chrono>
#include <cstdint>
#include <exception>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <vector>

namespace filiform::tools {

// A set to serve.
struct ShelfEntry {
  std::string name, path;  // the path: a folder or an address
  RemoteOptions remote{};
  std::uint64_t budget_bytes = 0;  // 0: a part of what the others leave, as it is used
  std::size_t open_files = 0;      // of a set in a folder, at least 3, that stay open; 0: half of the process's limit
  std::vector<std::string> readers = {};  // names or patterns of people; empty: everybody

  // True if the set need not be opened again.
  bool operator==(const ShelfEntry& other) const {
    return name == other.name && path == other.path && remote.token == other.remote.token &&
           budget_bytes == other.budget_bytes;
  }
};

// PATH or NAME=PATH each. The name of a PATH is that of its folder without `.fil`. Throws UsageError if a name is
// empty.
std::vector<ShelfEntry> shelfEntries(const std::vector<std::string>& texts, const RemoteOptions& remote = {});

class SetShelf {
 public:
  // Opens the sets. Those that cannot be opened are tried again by refresh(). Throws UsageError if two sets have the
  // same name; if none can be opened, as TileSet::open() does for the first one.
  SetShelf(const std::vector<ShelfEntry>& entries, std::uint64_t budget_bytes);

  // What the service says about one set.
  struct State {
    std::string name;
    bool open = false;           // it has a revision that can be read
    bool ready = false;          // this revision is the newest one
    std::uint64_t requests = 0;  // that found it so far
  };
  // In the order of the entries. Here and below, only the sets that `who` may know of; nullptr: all sets.
  std::vector<State> states(const Person* who = nullptr) const;
  // Serves these sets from now on: opens new ones, and those whose entry has changed; forgets those that are left out.
  // A set that cannot be opened keeps what was served under its name. Requests in work keep their sets. Throws
  // UsageError if two have the same name; nothing changes then. One thread at a time, which is that of refresh().
  void replace(const std::vector<ShelfEntry>& entries);

  // The sets that are open, in the order of the entries.
  std::vector<std::shared_ptr<const ServedSet>> all(const Person* who = nullptr) const;
  // For one request. nullptr: there is none, or it is not open.
  std::shared_ptr<const ServedSet> find(const std::string& name, const Person* who = nullptr) const;
  bool isCurrent(const ServedSet& served) const;                         // find() of its name gives it
  bool has(const std::string& name, const Person* who = nullptr) const;  // open or not
  // The revision of a set, also one of the last two before the current one; nullptr if the shelf has it not.
  std::shared_ptr<const TileSet> revision(const std::string& name, const std::string& revision) const;

  // Reads CURRENT of each set, and opens newer revisions; every ten seconds for a set at an address, or that is not
  // open. A set that cannot be opened keeps its revision. Returns one line for each set that could not be read. Then
  // shares the budget anew: sets that were asked for in the last minute have seven eighths of it, the others the rest.
  // One thread at a time. O(sets), plus opening.
  std::vector<std::string> refresh();
  // The lines of the last refresh().
  std::vector<std::string> problems() const;

 private:
  struct Slot {
    ShelfEntry entry;
    std::shared_ptr<const TileSource> watched{};            // of a set at an address
    std::shared_ptr<const ServedSet> current{};             // nullptr: never opened
    std::vector<std::shared_ptr<const TileSet>> older{};    // latest first
    std::chrono::steady_clock::time_point next_look{};      // of a set at an address, or not open
    std::string problem{};                                  // of its last look
    std::optional<std::vector<std::string>> stale{};        // `current` is that of an earlier entry, with these readers
    std::uint64_t budget_bytes = 0;                         // of `current`
    mutable std::uint64_t requests = 0;                     // of find(); under the mutex, as what follows
    mutable std::chrono::steady_clock::time_point asked{};  // by the last of them
  };
  static constexpr std::size_t kOlder = 2;

  void open(Slot& slot) const;
  // Opens the slots that are not open; a failure becomes the slot's problem. Returns that of the first slot.
  std::exception_ptr openNew(std::vector<Slot>& slots) const;
  const Slot* slot(const std::string& name) const;
  static bool sees(const Person* who, const Slot& slot);
  void shareBudget();

  const std::uint64_t budget_bytes_;
  std::uint64_t part_bytes_ = 0;  // of a set without a budget of its own
  mutable std::mutex mutex_;
  std::vector<Slot> slots_;
  std::vector<std::string> problems_;
};

}  // namespace filiform::tools
