#include "viewer/window/travel/internal/bookmarks.h"

#include "index/count_text.h"
#include "index/errors.h"
#include "index/output.h"
#include "index/text.h"
#include "viewer/window/travel/internal/new_file.h"
#include "viewer/window/travel/internal/travel.h"

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <utility>

namespace filiform::internal {
namespace {

constexpr std::size_t kMostUndone = 100;
constexpr std::uintmax_t kMostBytes = 64U << 20;  // of a table

std::vector<BookmarkRow> rowsOf(const TileStore& store, const std::map<std::string, ProxyPlace>& places) {
  std::vector<BookmarkRow> rows;
  for (const auto& [name, place] : places) {
    const SegmentId segment = place.segment;
    BookmarkRow row{.name = name, .cell = store.cell(segment.cell).name, .p_W = place.p_W};
    const IdRuns ids = store.loadCellDetail(segment.cell).sample_ids;
    if (segment.segment < ids.size()) row.sample = ids[segment.segment];
    rows.push_back(std::move(row));
  }
  return rows;
}

std::string textOfFile(const std::string& path) {
  std::error_code error;
  const std::uintmax_t bytes = std::filesystem::file_size(path, error);
  if (error) throw IoError(inShort(path), "cannot read", error.value());
  if (bytes > kMostBytes) throw InputError(inShort(path) + ": more than 64 MiB; cut the table");
  std::ifstream in(path, std::ios::binary);
  std::string text{std::istreambuf_iterator<char>(in), std::istreambuf_iterator<char>()};
  if (!in) throw IoError(inShort(path), "cannot read");
  return text;
}

}  // namespace

Bookmarks::Places Bookmarks::now() const {
  const NavigationHistory& history = std::as_const(travel_).history();
  Places places;
  for (const std::string& name : history.bookmarks()) places[name] = *history.bookmark(name);
  return places;
}

void Bookmarks::keep() {
  before_.push_back(now());
  if (before_.size() > kMostUndone) before_.erase(before_.begin());
}

void Bookmarks::set(const std::string& name) {
  if (!travel_.now().place.valid()) return messages_.say("cannot set a bookmark: the hand is free (f)");
  keep();
  travel_.history().setBookmark(name, travel_.now().place);
  travel_.savePlaces();
  messages_.say("bookmark " + inShort(name) + " is set");
}

void Bookmarks::go(const std::string& name) {
  if (const auto place = travel_.history().bookmark(name)) return travel_.goToFound(*place);
  messages_.say("there is no bookmark " + inShort(name));
}

void Bookmarks::remove(const std::string& name) {
  keep();
  travel_.history().removeBookmark(name);
  travel_.savePlaces();
  messages_.say("bookmark " + inShort(name) + " is deleted; undo brings it back");
}

void Bookmarks::undo() {
  if (before_.empty()) return messages_.say("no change of bookmarks to undo");
  const Places before = std::move(before_.back());
  before_.pop_back();
  NavigationHistory& history = travel_.history();
  for (const std::string& name : history.bookmarks()) history.removeBookmark(name);
  for (const auto& [name, place] : before) history.setBookmark(name, place);
  travel_.savePlaces();
  messages_.say(counted(before.size(), "bookmark") + ", as before");
}

void Bookmarks::write(std::function<void(std::string csv)> written) {
  travel_.ask([&store = travel_.store(), places = now(), written = std::move(written)]() -> Worker::Done {
    return [written, csv = bookmarksCsv(rowsOf(store, places))] { written(csv); };
  });
}

void Bookmarks::save(const std::string& folder) {
  travel_.ask([this, &store = travel_.store(), places = now(), folder]() -> Worker::Done {
    Output out(newFileIn(folder, "bookmarks", ".csv"));
    out.write(bookmarksCsv(rowsOf(store, places)));
    out.finish();
    return [this, text = counted(places.size(), "bookmark") + " written to " + inShort(out.path())] {
      messages_.say(text);
    };
  });
}

void Bookmarks::read(const std::string& csv) {
  read([csv] { return readBookmarks(csv); });
}

void Bookmarks::readFile(const std::string& path) {
  read([path] { return readBookmarks(textOfFile(path)); });
}

void Bookmarks::add(const std::vector<ViewState::Bookmark>& bookmarks) {
  ReadBookmarks table;
  for (const auto& [name, p_W] : bookmarks)
    if (table.rows.size() < ReadBookmarks::kMost && !travel_.history().bookmark(name))
      table.rows.push_back({.name = name, .cell = {}, .p_W = p_W});
  if (!table.rows.empty()) read([table] { return table; });
}

void Bookmarks::read(std::function<ReadBookmarks()> rows) {
  travel_.ask([this, &finder = travel_.finder(), rows = std::move(rows)]() -> Worker::Done {
    const ReadBookmarks table = rows();
    Places places;
    std::uint64_t left_out = table.left_out;
    for (const BookmarkRow& row : table.rows) {
      if (travel_.isLeaving()) return {};
      try {
        if (const auto found = finder.nearest(row.p_W)) places[row.name] = found->place;
      } catch (const Error&) {
        ++left_out;
      }
    }
    return [this, places, left_out] {
      if (!places.empty()) keep();
      for (const auto& [name, place] : places) travel_.history().setBookmark(name, place);
      travel_.savePlaces();
      std::string said = counted(places.size(), "bookmark") + " read";
      if (left_out > 0)
        said += "; " + counted(left_out, "row") + " left out: no name, no place that can be read, or more than 10 000";
      messages_.say(said);
    };
  });
}

}  // namespace filiform::internal
