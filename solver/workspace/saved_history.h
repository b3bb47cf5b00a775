// A person's history of jumps and bookmarks of one set, kept beside the user's settings:
//
//   SavedHistory saved(*set, SavedHistory::pathFor("column.fil"));
//   if (!saved.warning().empty()) std::cerr << saved.warning() << '\n';  // one line for the person
//   saved.history().setBookmark("soma", place);
//   saved.save();
//
// The file is JSON, named after the set. A place in it is a cell's name, the id of the segment's child in its file, and
// where between child and parent: so it survives another ingest of the same data with other options, and every place
// whose cell and sample are still there is found again. Bookmarks whose cell or sample is not in the set now are kept
// in the file. Thread rule: thread-compatible; for the commanding thread, never the haptic one.
#pragma once

#include "index/set/tile_store.h"
#include "solver/workspace/history.h"

#include <memory>
#include <string>

namespace filiform {

class SavedHistory {
 public:
  static constexpr std::size_t kMostPlaces = 100;  // of the history, the newest; bookmarks are not limited

  // $XDG_CONFIG_HOME/filiform/places/NAME.json, or below ~/.config; NAME is the last part of the set's path, with bytes
  // that are awkward in file names as %XX. Throws UsageError where neither variable is set to an absolute path, or the
  // path has no name.
  static std::string pathFor(const std::string& set_path);

  // Reads the file. None is no fault; a damaged one is moved aside (FILE.damaged), a warning, and a fresh start. The
  // store must outlive it. Throws IoError when a file is there but cannot be read; CorruptSet, CorruptTile from the
  // store. O(places), and a tile read for each.
  SavedHistory(const TileStore& store, std::string path);
  ~SavedHistory();

  NavigationHistory& history();
  // One line, or empty: the file was damaged, or places were not found.
  const std::string& warning() const;

  // Replaces the file at once (index/output.h), its folder made if needed: a crash leaves the old file or the new one.
  // Throws IoError; CorruptSet from the store.
  void save() const;
  // Likewise with a copy of the history in place of history(). Another thread may call it while the owner changes
  // history(); one call at a time.
  void save(const NavigationHistory& history) const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace filiform
