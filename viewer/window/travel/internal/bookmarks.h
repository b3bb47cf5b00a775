// The user's bookmarks: names, undo, and tables of them. Thread rule: the window's thread.
#pragma once

#include "viewer/scene/view_state.h"
#include "viewer/window/settings/internal/messages.h"
#include "viewer/window/travel/internal/bookmark_file.h"

#include <functional>
#include <map>
#include <string>
#include <vector>

namespace filiform::internal {

class Travel;

class Bookmarks {
 public:
  // Both must outlive it.
  Bookmarks(Travel& travel, Messages& messages) : travel_(travel), messages_(messages) {}

  // At the proxy; replaces one of this name.
  void set(const std::string& name);
  void go(const std::string& name);
  void remove(const std::string& name);
  void undo();  // the last change of bookmarks
  bool canUndo() const { return !before_.empty(); }

  // As CSV; calls back from a later Travel::serve().
  void write(std::function<void(std::string csv)> written);
  // To a new file in the folder.
  void save(const std::string& folder);
  // Sets those of a table, on the nearest neurites. Names that exist are replaced.
  void read(const std::string& csv);
  void readFile(const std::string& path);
  void add(const std::vector<ViewState::Bookmark>& bookmarks);

 private:
  using Places = std::map<std::string, ProxyPlace>;
  Places now() const;
  void keep();  // what undo() returns to
  void read(std::function<ReadBookmarks()> rows);

  Travel& travel_;
  Messages& messages_;
  std::vector<Places> before_;
};

}  // namespace filiform::internal
