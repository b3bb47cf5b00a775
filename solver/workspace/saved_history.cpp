#include "solver/workspace/saved_history.h"

#include "index/cell/cell.h"
#include "index/errors.h"
#include "index/output.h"
#include "index/text.h"
#include "index/whole_number.h"
#include "solver/graph/graph_view.h"

#include <algorithm>
#include <cerrno>
#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <optional>
#include <sstream>
#include <vector>

#include <nlohmann/json.hpp>

namespace filiform {
namespace {

namespace fs = std::filesystem;
using nlohmann::ordered_json;

constexpr int kVersion = 1;

// The sample ids of the cell of the last request; requests for one cell come in sequence.
class CellIds {
 public:
  explicit CellIds(const TileStore& store) : store_(store) {}
  const CellDetail& of(std::uint32_t cell) {
    if (!detail_ || cell_ != cell) detail_ = store_.loadCellDetail(cell);
    cell_ = cell;
    return *detail_;
  }

 private:
  const TileStore& store_;
  std::uint32_t cell_ = 0;
  std::optional<CellDetail> detail_;
};

// Finds saved places in a set.
class Finder {
 public:
  explicit Finder(const TileStore& store)
      : store_(store), table_(store.tile_count()), graph_(table_, store.leaves(), store.grid()), ids_(store) {}

  // Returns nullopt if the set has no such cell or sample. Throws nlohmann::json::exception or std::out_of_range if
  // `saved` is not a place.
  std::optional<ProxyPlace> find(const ordered_json& saved) {
    const std::string name = saved.at("cell").get<std::string>();
    const double t = saved.at("t").get<double>();
    const Vector3d p_W(saved.at("x").get<double>(), saved.at("y").get<double>(), saved.at("z").get<double>());
    const bool by_sample = saved.contains("sample");
    const std::int64_t number = wholeNumber<std::int64_t>(saved.at(by_sample ? "sample" : "segment"));
    if (!std::isfinite(t) || !p_W.allFinite()) return std::nullopt;
    const std::optional<std::uint32_t> cell = store_.findCell(name);
    if (!cell) return std::nullopt;
    const CellDetail& detail = ids_.of(*cell);
    std::vector<std::uint32_t> ranks;
    if (!by_sample) {
      if (!std::in_range<std::uint32_t>(number)) return std::nullopt;
      ranks.push_back(static_cast<std::uint32_t>(number));
    } else {
      ranks = detail.sample_ids.ranksOf(number);
    }
    if (ranks.empty()) return std::nullopt;

    // Looks first where the place was when it was saved.
    std::vector<TileId> tiles;
    if (p_W.cwiseAbs().maxCoeff() <= Grid::kMaxCoordinate_um)
      if (const TileId home = store_.home(store_.grid().snap(p_W)); home != kNoTile) tiles.push_back(home);
    if (store_.long_tile() != kNoTile) tiles.push_back(store_.long_tile());
    tiles.insert(tiles.end(), detail.tiles.begin(), detail.tiles.end());
    std::optional<ProxyPlace> best;
    for (const TileId tile : tiles) {
      const std::shared_ptr<const Tile> loaded = store_.load(tile);
      table_.add(*loaded);
      for (const std::uint32_t rank : ranks) {
        const ProxyPlace place = graph_.placeAt(tile, {*cell, rank}, t);
        if (place.valid() && (!best || (place.p_W - p_W).norm() < (best->p_W - p_W).norm())) best = place;
      }
      table_.retire(tile);
      if (best && (ranks.size() == 1 || best->p_W == p_W)) break;
    }
    return best;
  }

 private:
  const TileStore& store_;
  TileTable table_;
  GraphView graph_;
  CellIds ids_;
};

ordered_json placeJson(const TileStore& store, CellIds& ids, const ProxyPlace& place) {
  ordered_json json{{"cell", store.cell(place.segment.cell).name}};
  const CellDetail& detail = ids.of(place.segment.cell);
  if (place.segment.segment < detail.sample_ids.size())
    json["sample"] = detail.sample_ids[place.segment.segment];
  else
    json["segment"] = place.segment.segment;
  json["t"] = place.t;
  json["x"] = place.p_W.x();
  json["y"] = place.p_W.y();
  json["z"] = place.p_W.z();
  return json;
}

}  // namespace

struct SavedHistory::Impl {
  const TileStore& store;
  std::string path, warning;
  NavigationHistory history{kMostPlaces};
  ordered_json lost_bookmarks = ordered_json::object();

  Impl(const TileStore& s, std::string file) : store(s), path(std::move(file)) {}

  void read() {
    std::error_code unknown;
    if (fs::is_directory(path, unknown)) throw IoError(path, "cannot read the saved places", EISDIR);
    std::ifstream file(path, std::ios::binary);
    if (!file) {
      if (errno == ENOENT || errno == ENOTDIR) return;
      throw IoError(path, "cannot read the saved places", errno);
    }
    std::ostringstream text;
    text << file.rdbuf();
    if (file.bad()) throw IoError(path, "cannot read the saved places", errno);
    try {
      const ordered_json json = ordered_json::parse(text.str());
      if (wholeNumber<std::int64_t>(json.at("version")) != kVersion) throw std::runtime_error("unknown version");
      Finder finder(store);
      std::size_t lost = 0;
      std::vector<ProxyPlace> places;
      const std::size_t saved_now = wholeNumber<std::size_t>(json.at("now"));
      std::size_t now = 0;
      for (std::size_t i = 0; i < json.at("history").size(); ++i) {
        const std::optional<ProxyPlace> place = finder.find(json.at("history")[i]);
        if (place) places.push_back(*place);
        lost += !place;
        if (i <= saved_now && !places.empty()) now = places.size() - 1;
      }
      history.restore(std::move(places), now);
      for (const auto& [name, saved] : json.at("bookmarks").items()) {
        if (const std::optional<ProxyPlace> place = finder.find(saved)) {
          history.setBookmark(name, *place);
        } else {
          lost_bookmarks[name] = saved;
          ++lost;
        }
      }
      if (lost > 0)
        warning = inShort(path) + ": " + std::to_string(lost) +
                  " saved places are not in this set: it has no such cell or sample; their bookmarks stay in the file";
    } catch (const nlohmann::json::exception& error) {
      startAfresh("not a file of saved places");
    } catch (const std::out_of_range& error) {
      startAfresh("not a file of saved places");
    } catch (const std::runtime_error& error) {
      if (dynamic_cast<const IoError*>(&error) || dynamic_cast<const CorruptSet*>(&error) ||
          dynamic_cast<const CorruptTile*>(&error))
        throw;
      startAfresh(error.what());
    }
  }

  void startAfresh(const std::string& why) {
    history = NavigationHistory(kMostPlaces);
    lost_bookmarks = ordered_json::object();
    std::error_code ignored;
    fs::rename(path, path + ".damaged", ignored);
    warning = inShort(path) + ": the saved places are damaged (" + why + "); the file is now " +
              inShort(fs::path(path).filename().string()) + ".damaged, and history and bookmarks are empty";
  }
};

std::string SavedHistory::pathFor(const std::string& set_path) {
  fs::path whole = fs::path(set_path).lexically_normal();
  if (!whole.has_filename()) whole = whole.parent_path();
  const std::string name = whole.filename().string();
  if (name.empty() || name == "." || name == "..")
    throw UsageError(inShort(set_path) + ": not the name of a set; places cannot be saved for it");
  std::string file;
  for (const char c : name) {
    const auto byte = static_cast<unsigned char>(c);
    if ((c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9') || c == '-' || c == '_' ||
        (c == '.' && !file.empty())) {
      file += c;
    } else {
      constexpr char kHex[] = "0123456789ABCDEF";
      file += {'%', kHex[byte >> 4], kHex[byte & 15]};
    }
  }
  const char* const config = std::getenv("XDG_CONFIG_HOME");
  const char* const home = std::getenv("HOME");
  fs::path folder;
  if (config && config[0] == '/')
    folder = config;
  else if (home && home[0] == '/')
    folder = fs::path(home) / ".config";
  else
    throw UsageError("places cannot be saved: set HOME or XDG_CONFIG_HOME to an absolute path");
  return (folder / "filiform" / "places" / (file + ".json")).string();
}

SavedHistory::SavedHistory(const TileStore& store, std::string path)
    : impl_(std::make_unique<Impl>(store, std::move(path))) {
  impl_->read();
}

SavedHistory::~SavedHistory() = default;

NavigationHistory& SavedHistory::history() { return impl_->history; }

const std::string& SavedHistory::warning() const { return impl_->warning; }

void SavedHistory::save() const { save(impl_->history); }

void SavedHistory::save(const NavigationHistory& history) const {
  const Impl& d = *impl_;
  CellIds ids(d.store);
  ordered_json json{{"version", kVersion}, {"now", history.now()}};
  json["history"] = ordered_json::array();
  for (const ProxyPlace& place : history.places()) json["history"].push_back(placeJson(d.store, ids, place));
  json["bookmarks"] = d.lost_bookmarks;
  for (const std::string& name : history.bookmarks())
    json["bookmarks"][name] = placeJson(d.store, ids, *history.bookmark(name));
  const std::string text = json.dump(1, ' ', true, nlohmann::json::error_handler_t::replace) + "\n";

  std::error_code error;
  const fs::path folder = fs::path(d.path).parent_path();
  fs::create_directories(folder, error);
  if (error) throw IoError(folder.string(), "cannot make the folder for saved places", error.value());
  Output out(d.path);
  out.write(text);
  out.finish();
}

}  // namespace filiform
