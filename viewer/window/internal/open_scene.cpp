#include "viewer/window/internal/open_scene.h"

#include "index/count_text.h"
#include "index/errors.h"
#include "index/text.h"
#include "viewer/window/panels/internal/network_text.h"
#include "viewer/window/settings/internal/text_format.h"

#include <algorithm>
#include <iterator>
#include <string>
#include <utility>

#include <nlohmann/json.hpp>

namespace filiform::internal {

namespace {

constexpr double kCountEvery_s = 0.25;
constexpr std::size_t kMostHighlighted = 64;  // cells: each is read and uploaded whole

}  // namespace

OpenScene::OpenScene(Opened opened, Messages& messages, Travel::Callbacks callbacks)
    : messages_(messages),
      viewpoint_(opened.session->workspaceOptions()),
      picture_(std::move(opened.picture)),
      choice_(opened.scene.store->cell_count()) {
  if (!opened.scene.only.empty()) choice_.isolate(opened.scene.only);
  choice_.choose(opened.scene.highlighted);
  travel_ = std::make_shared<Travel>(std::move(opened), messages, std::move(callbacks));
  bookmarks_ = std::make_unique<Bookmarks>(*travel_, messages);
  attributes_ = std::make_unique<AttributeView>(*travel_->scene().store, travel_->scene().colours);
  cells_ = std::make_shared<CellTable>(*travel_->scene().store, attributes_->attributes());
  contacts_ = std::make_shared<ContactView>(*travel_->scene().store, travel_->finder());
}

void OpenScene::turn(const Turn& turn) {
  if (viewpoint_.isOverview())
    viewpoint_.turn(turn);
  else
    travel_->turn(turn);
}

void OpenScene::zoom(double factor) {
  if (viewpoint_.isOverview())
    viewpoint_.zoom(factor);
  else
    travel_->zoom(factor);
}

void OpenScene::nextOverview() { viewpoint_.nextOverview(picture_->far_segments() > 0); }

void OpenScene::look(const PictureSize& size, bool orthographic, double now_s) {
  const bool whole = viewpoint_.showsFar();
  NavigationSnapshot seen = now();
  if (goesAlong()) {
    seen.centre_W = companion_->centre_W;
    seen.rotation_WD = companion_->rotation_WD.normalized();
    seen.zoom_um = companion_->zoom_um;
  }
  camera_ = viewpoint_.look(seen, whole ? picture_->lo_W() : picture_->usual_lo_W(),
                            whole ? picture_->hi_W() : picture_->usual_hi_W(), size.aspect(), now_s);
  if (orthographic) camera_ = parallel(camera_);
  view_ = viewOf(camera_, size.aspect(), 1);
}

void OpenScene::countTiles(bool listed, double now_s) {
  if (now_s - tiles_counted_s_ <= kCountEvery_s) return;
  const Residency* residency = travel_->session().residency();
  tiles_ = internal::countTiles(travel_->store(), residency, tiles_, std::max(now_s - tiles_counted_s_, 1e-3));
  tiles_counted_s_ = now_s;
  tiles_.frontiers = now().frontiers;
  if (!listed) return;
  travel_->listTiles([this](std::vector<NearTile> near) { near_ = std::move(near); });
  showTiles(near_, residency, tiles_);
}

SceneFrame OpenScene::frame(bool own_cell, Theme theme) {
  SceneFrame frame = frameOf(own_cell, theme);
  highlighted_ = frame.cells;
  hidden_types_ = frame.hidden_types;
  return frame;
}

SceneFrame OpenScene::frameOf(bool own_cell, Theme theme) {
  try {
    attributes_->setTheme(theme);
  } catch (const std::exception& error) {
    messages_.say(error.what());
  }
  SceneFrame frame;
  frame.background = groundOf(theme);
  frame.states = choice_.states();
  for (std::size_t i = 0; i < types_.size(); ++i)
    if (!types_[i].chosen) frame.hidden_types |= static_cast<std::uint8_t>(1U << ((i + 1) % types_.size()));
  travel_->setStates(frame.states);
  const auto isShown = [this](std::uint32_t cell) { return choice_.stateOf(cell) != CellState::hidden; };
  const std::vector<std::uint32_t>& chosen = choice_.chosen();
  if (chosen.size() <= kMostHighlighted && !choice_.isAlone(chosen))
    std::copy_if(chosen.begin(), chosen.end(), std::back_inserter(frame.cells), isShown);
  frame.camera = camera_;
  frame.cell_colours = attributes_->colours();
  if (now().tick > 0) frame.proxy_W = now().p_W;
  frame.marks_W = contacts_->marks_W();
  if (companion_) frame.companion_W = companion_->p_W;
  if (viewpoint_.isOverview()) return frame;
  frame.workspace = &viewpoint_.workspace();
  if (own_cell && chosen.empty() && now().place.valid() && !goesAlong()) {
    const std::uint32_t own = now().place.segment.cell;
    if (isShown(own) && !choice_.isAlone({&own, 1})) frame.cells = {own};
  }
  if (now().tick > 0 && now().has_stylus)
    frame.stylus = Stylus{now().h_W, now().rotation_WD * Eigen::Quaterniond(now().stylus_D)};
  frame.junction = travel_->junction();
  return frame;
}

bool OpenScene::hasLostNetwork() const {
  const OpenedScene& scene = travel_->scene();
  return scene.network && scene.network().lost;
}

void OpenScene::serveAttributes(const PanelRequests& requests) {
  try {
    if (requests.attribute) colourBy(*requests.attribute);
    if (requests.value && attributes_->colours() == nullptr) toggleType(*requests.value, requests.value_alone);
    if (requests.value && attributes_->colours() != nullptr) {
      attributes_->toggle(*requests.value, requests.value_alone);
      choice_.isolate(attributes_->selected());
    }
    if (requests.select_all) {
      attributes_->selectAll();
      choice_.showAll();
      types_ = legendOfTypes();
    }
  } catch (const Error& error) {
    messages_.say(error.what());
  }
}

void OpenScene::toggleType(const std::string& value, bool alone) {
  std::vector<CellColours::Entry> next = types_;
  for (CellColours::Entry& type : next)
    if (alone || type.value == value) type.chosen = alone ? type.value == value : !type.chosen;
  const auto same = [](const auto& a, const auto& b) { return a.chosen == b.chosen; };
  const bool again = std::equal(next.begin(), next.end(), types_.begin(), same);
  const bool none = std::none_of(next.begin(), next.end(), [](const auto& type) { return type.chosen; });
  types_ = again || none ? legendOfTypes() : std::move(next);
}

void OpenScene::colourBy(const std::string& name) {
  wanted_colours_ = nullptr;
  if (!name.starts_with(kMeasurePrefix)) return attributes_->colourBy(name);
  const Feature* feature = findFeature(name.substr(kMeasurePrefix.size()));
  if (feature == nullptr) throw UsageError("there is no measure " + inShort(name.substr(kMeasurePrefix.size())));
  wanted_colours_ = feature;
  cells_->measure();
}

void OpenScene::servePanels(const OpenPanels& open) {
  if (open.cells.open && !cells_->isOpen()) cells_->open();
  if (!open.cells.open && cells_->isOpen()) cells_->close();
  if (!open.contacts.open) contacts_->close();
  cells_->serve();
  contacts_->serve();
  if (now().place.valid() && own_cell_ != now().place.segment.cell) {
    const bool jumped = std::exchange(own_cell_, now().place.segment.cell).has_value();
    if (jumped && choice_.chosen().size() == 1 && choice_.chosen().front() != own_cell_) choice_.choose({});
  }
  if (wanted_colours_ == nullptr) return;
  if (auto numbers = cells_->numbersOf(*wanted_colours_)) {
    wanted_colours_ = nullptr;
    attributes_->colourBy(std::move(*numbers));
  } else if (!cells_->progress()) {
    wanted_colours_ = nullptr;
    messages_.say(cells_->error().empty() ? "measuring is cancelled" : cells_->error());
  }
}

void OpenScene::serveBookmarks(const BookmarkRequests& asked, const std::string& folder) {
  if (asked.set) bookmarks_->set(*asked.set);
  if (asked.go) bookmarks_->go(*asked.go);
  if (asked.remove) bookmarks_->remove(*asked.remove);
  if (asked.undo) bookmarks_->undo();
  if (asked.paste) bookmarks_->read(*asked.paste);
  if (asked.save) bookmarks_->save(folder);
  if (asked.copy)
    bookmarks_->write([this](const std::string& csv) {
      copied_ = csv;
      messages_.say("the bookmarks are copied");
    });
}

bool OpenScene::actOnCells(Action action, std::optional<std::uint32_t> cell) {
  std::vector<std::uint32_t> cells = choice_.chosen();
  if (cell) cells = {*cell};
  if (cells.empty() && now().place.valid()) cells = {now().place.segment.cell};
  if (action == Action::show_cells) {
    choice_.showAll();
    types_ = legendOfTypes();
    if (attributes_->colours() != nullptr) attributes_->selectAll();
  } else if (action == Action::invert_cells) {
    if (!choice_.hidesSome()) return messages_.say("no cell is hidden (H hides, I isolates)"), true;
    choice_.invert();
  } else if (action == Action::isolate_cells || action == Action::hide_cells || action == Action::dim_cells) {
    if (cells.empty()) return messages_.say("choose a cell first: click it, or n for the table"), true;
    const bool dimmed =
        std::all_of(cells.begin(), cells.end(), [this](auto one) { return choice_.stateOf(one) == CellState::dimmed; });
    if (action == Action::isolate_cells) choice_.isolate(cells);
    if (action == Action::hide_cells) choice_.set(cells, CellState::hidden);
    if (action == Action::dim_cells) choice_.set(cells, dimmed ? CellState::shown : CellState::dimmed);
    if (action != Action::isolate_cells && !cell) choice_.choose({});
  } else {
    return false;
  }
  messages_.say(choice_.text().empty() ? "all cells are shown" : choice_.text() + " (A: all)");
  return true;
}

void OpenScene::findContacts(double within_um) {
  if (!now().place.valid()) return messages_.say("cannot find contacts: the hand is free (f)");
  contacts_->find(now().place.segment.cell, within_um);
}

void OpenScene::jumpAcross(std::optional<std::size_t> site) {
  const std::uint32_t from = now().place.segment.cell;
  const ContactView::Site* across = nullptr;
  if (site && *site < contacts_->sites().size())
    across = &contacts_->sites()[*site];
  else if (!site && now().place.valid())
    across = contacts_->nearest(from, now().p_W);
  if (across == nullptr) return messages_.say("no contact of this cell is marked (i)");
  const ContactView::Side& to = ContactView::across(*across, from);
  travel_->goToPlace(to.cell, to.place);
}

bool OpenScene::selectCells(const std::string& condition, std::string& error) {
  try {
    const std::size_t cells = attributes_->select(condition);
    error = cells == 0 ? "no cell meets this condition" : "";
    if (cells > 0) messages_.say(counted(cells, "cell") + " selected");
    return cells > 0;
  } catch (const Error& failure) {
    error = failure.what();
    return false;
  }
}

bool OpenScene::nextColouring(ColourBy settings) {
  if (attributes_->attribute().empty() && !attributes_->hasTable() && settings != *std::rbegin(kColourings))
    return false;
  try {
    if (!attributes_->next()) return false;
    messages_.say("coloured by " + attributes_->attribute());
  } catch (const Error& error) {
    messages_.say(error.what());
  }
  return true;
}

void OpenScene::draw(const SceneFrame& frame) {
  figures_ = picture_->draw(frame);
  const bool lacks_levels = figures_.tiles_left_out > 0 && !figures_.moving && !travel_->scene().levels;
  if (lacks_levels && !std::exchange(told_missing_levels_, true))
    messages_.say(
        "this scene has no levels of detail: distant tiles are left out (ingest the set again without --no-levels)");
}

void OpenScene::fill(PanelData& d, const PictureSize& size, ColourBy colouring) {
  const NavigationSnapshot& s = now();
  d.um_px = camera_.focus_um / pixelsPerRadian(view_.frustum, size);
  d.status.scene = travel_->scene().name;
  d.status.cell = travel_->cellName();
  attributes_->fill(d);
  if (attributes_->colours() == nullptr) {
    depths_ = legendOfDepths(picture_->hi_W().y(), picture_->lo_W().y());
    d.colours.legend = colouring == ColourBy::type     ? &types_
                       : colouring == ColourBy::depth  ? &depths_
                       : colouring == ColourBy::radius ? &legendOfRadii()
                                                       : nullptr;
    if (d.colours.legend != nullptr) d.colours.kind = toString(colouring);
    if (colouring == ColourBy::depth || colouring == ColourBy::radius) d.colours.unit = "um";
    d.colours.selected = std::any_of(types_.begin(), types_.end(), [](const auto& type) { return !type.chosen; });
  }
  d.cells.table = cells_.get();
  d.contacts = contacts_.get();
  d.cells.choice = &choice_;
  d.status.neurite = travel_->neurite();
  if (const auto part = cells_->progress(); part && !cells_->isOpen())
    d.status.measuring = format("measuring the cells, %.0f %%", 100 * *part);
  if (travel_->sample()) d.status.place = format("sample %lld, ", static_cast<long long>(*travel_->sample()));
  d.status.place += format("%.1f %.1f %.1f \u00b5m", s.p_W.x(), s.p_W.y(), s.p_W.z());
  d.status.device = travel_->session().deviceName();
  d.status.mode = toString(s.mode);
  if (travel_->session().awaited()) d.status.mode += ", jumping";
  if (s.frontier) d.status.mode += ", waiting for a tile";
  d.map.zoom_um = s.zoom_um;
  d.force.now_N = s.force_N.norm();
  d.status.measure = travel_->measured();
  d.status.segments = figures_.segments;
  d.status.left_out = figures_.left_out;
  d.status.pending = figures_.pending;
  d.status.error_px = figures_.error_px;
  if (travel_->scene().network) d.lines.network = networkText(travel_->scene().network());
  d.status.unreadable = figures_.failed.size() + tiles_.failures.size();
  d.hand.overview = viewpoint_.isOverview();
  d.force.last_N = &travel_->forces_N();
  if (s.tick > 0 && !viewpoint_.isGliding()) {
    d.hand.proxy = project(view_, s.p_W, size);
    if (!d.hand.overview && s.mode == NavigationMode::constrained) d.hand.hand = project(view_, s.h_W, size);
  }
  if (companion_) {
    d.companion.name = companion_->name;
    d.companion.proxy = project(view_, companion_->p_W, size);
    d.companion.force_N = companion_->force_N;
    if (companion_->constrained) d.companion.hand = project(view_, companion_->h_W, size);
  }
  d.map.lo_W = picture_->lo_W();
  d.map.hi_W = picture_->hi_W();
  d.map.proxy_W = s.p_W;
  d.map.centre_W = s.centre_W;
  d.map.visited_W = travel_->visited_W();
  const NavigationHistory& history = travel_->history();
  for (const std::string& name : history.bookmarks()) {
    d.map.bookmark_names.push_back(name);
    d.map.bookmarks_W.push_back(history.bookmark(name)->p_W);
  }
}

void OpenScene::describe(nlohmann::ordered_json& json, const PictureSize& size) const {
  travel_->describe(json);
  attributes_->describe(json);
  cells_->describe(json);
  contacts_->describe(json);
  choice_.describe(json);
  const ScreenPoint proxy = project(view_, now().p_W, size);
  if (proxy.depth_um > 0) json["proxy_px"] = {proxy.x, proxy.y};
  json["overview"] = viewpoint_.isOverview();
  if (companion_) {
    const ScreenPoint at = project(view_, companion_->p_W, size);
    json["companion"] = {{"name", companion_->name},
                         {"p_um", {companion_->p_W.x(), companion_->p_W.y(), companion_->p_W.z()}},
                         {"zoom_um", companion_->zoom_um},
                         {"force_N", companion_->force_N},
                         {"along", companion_->along}};
    if (at.depth_um > 0) json["companion"]["px"] = {at.x, at.y};
  }
  json["shift"] = {viewpoint_.shift().x(), viewpoint_.shift().y()};
  json["segments"] = figures_.segments;
  json["left_out"] = figures_.left_out;
  json["pending"] = figures_.pending;
  json["complete"] = figures_.complete;
  json["moving"] = figures_.moving;
  json["error_px"] = figures_.error_px;
  json["resident_bytes"] = tiles_.counters.bytes;
  if (travel_->scene().network) json["network"] = networkText(travel_->scene().network());
  json["failures"] = figures_.failed.size() + tiles_.failures.size();
}

std::function<void()> OpenScene::end() {
  return [loader = picture_->end(), cells = std::move(cells_), contacts = std::move(contacts_),
          travel = std::move(travel_)]() mutable {
    loader.reset();
    cells.reset();
    contacts.reset();
    travel->finish();
  };
}

}  // namespace filiform::internal
