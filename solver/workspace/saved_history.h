// A user's history of jumps and bookmarks of one set, stored with the user's settings:
//
//   SavedHistory saved(*set, SavedHistory::pathFor("column.fil"));
//   if (!saved.warning().empty()) std::cerr << saved.warning() << '\n';  // one line for the user
//   saved.history().setBookmark("soma", place);
//   saved.save();
//
// The file is JSON and has the name of the set. A place is stored as the name of its cell, the id of the segment's
// child in its file, and the position between child and parent. So places survive another ingest of the same data with
// other options: each place whose cell and sample still exist is found again. The file keeps bookmarks whose cell or
// sample is missing in the set now. Thread rule: thread-compatible; for the commanding thread, never the haptic thread.
#pragma once

#include "index/set/tile_store.h"
#include "solver/workspace/history.h"

#include <memory>
#include <string>

namespace filiform {

class SavedHistory {
 public:
  static constexpr std::size_t kMostPlaces = 100;  // newest places of the history; bookmarks are not limited

  // $XDG_CONFIG_HOME/filiform/places/NAME.json, or the same path below ~/.config. NAME is the last part of the set's
  // path. Letters, digits, '-', '_' and '.' are kept; other bytes, and a leading '.', are written as %XX. Throws
  // UsageError if neither XDG_CONFIG_HOME nor HOME is an absolute path, or if the path has no last part.
  static std::string pathFor(const std::string& set_path);

  // Reads the file, if it exists. A damaged file is renamed to FILE.damaged; a warning is set, and history and
  // bookmarks are empty. The store must outlive the object. Throws IoError if the file exists but cannot be read;
  // CorruptSet and CorruptTile from the store. O(places); reads about one tile for each place.
  SavedHistory(const TileStore& store, std::string path);
  ~SavedHistory();

  NavigationHistory& history();
  // One line: the file was damaged, or places were not found. Empty if all is well.
  const std::string& warning() const;

  // Replaces the file atomically (index/output.h) and creates its folder if needed. A crash leaves either the old or
  // the new file. Throws IoError; CorruptSet from the store.
  void save() const;
  // Like save(), with a copy of the history instead of history(). Another thread may call this while the owner changes
  // history(); one call at a time.
  void save(const NavigationHistory& history) const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace filiform
