// OpenScene: what is shown as a file.
#include "index/errors.h"
#include "index/output.h"
#include "index/text.h"
#include "viewer/scene/view_cells.h"
#include "viewer/window/internal/open_scene.h"
#include "viewer/window/travel/internal/new_file.h"

#include <array>
#include <string>
#include <utility>

namespace filiform::internal {

namespace {

using Ids = std::vector<std::uint32_t>;

std::vector<std::string> namesOf(const TileStore& store, const Ids& cells) {
  std::vector<std::string> names;
  for (const std::uint32_t cell : cells)
    if (const CellRecord& record = store.cell(cell); !record.removed) names.push_back(record.name);
  return names;
}

}  // namespace

void OpenScene::saveView(const Settings& settings, const PictureSize& size, const std::string& folder) {
  const NavigationSnapshot& s = now();
  const OpenedScene& scene = travel_->scene();
  ViewState view;
  view.set = scene.name;
  view.revision = scene.revision;
  view.centre_W = s.centre_W;
  view.rotation_WD = s.rotation_WD;
  view.zoom_um = s.zoom_um;
  view.overview = viewpoint_.isOverview();
  view.look = viewpoint_.look();
  view.camera = camera_;
  view.size = size;
  view.orthographic = settings.orthographic;
  view.theme = settings.theme;
  const std::string& attribute = attributes_->attribute();
  view.colour_by = attribute.empty()                       ? toString(settings.colouring)
                   : colouringNamed(attribute).has_value() ? "attribute:" + attribute
                                                           : attribute;
  view.hidden_types = hidden_types_;
  for (const std::string& name : travel_->history().bookmarks())
    view.bookmarks.push_back({name, travel_->history().bookmark(name)->p_W});
  std::array<Ids, 3> in_state;  // shown, hidden, dimmed
  for (std::uint32_t cell = 0; choice_.states() != nullptr && cell < choice_.states()->size(); ++cell) {
    const CellState state = choice_.stateOf(cell);
    in_state[state == CellState::hidden ? 1 : 0].push_back(cell);
    if (state == CellState::dimmed) in_state[2].push_back(cell);
  }
  view.shows_some = in_state[1].size() > in_state[0].size();
  in_state[view.shows_some ? 1 : 0].clear();
  travel_->ask([this, &store = travel_->store(), place = s.place, heading_W = travel_->heading_W(), view, in_state,
                chosen = choice_.chosen(), highlighted = highlighted_, folder]() mutable -> Worker::Done {
    if (place.valid()) view.place = {store.cell(place.segment.cell).name, place.p_W, heading_W};
    view.shown = namesOf(store, in_state[0]);
    view.hidden = namesOf(store, in_state[1]);
    view.dimmed = namesOf(store, in_state[2]);
    view.chosen = namesOf(store, chosen);
    view.highlighted = namesOf(store, highlighted);
    const std::string json = toJson(view);
    std::string said = "the view is copied as JSON", copied = json;
    if (!folder.empty()) {
      Output out(newFileIn(folder, "view", ".json"));
      out.write(json);
      out.finish();
      copied = "filiform view " + view.set + " --view " + out.path();
      said = inShort(out.path()) + " is written, and its command copied";
    }
    return [this, said, copied] {
      copied_ = copied;
      messages_.say(said);
    };
  });
}

void OpenScene::show(const ViewState& view) {
  if (now().tick > 0) travel_->turnTo(view.rotation_WD);
  viewpoint_.set(view.overview, view.look);
  for (std::size_t i = 0; i < types_.size(); ++i)
    types_[i].chosen = ((view.hidden_types >> ((i + 1) % types_.size())) & 1U) == 0;
  bookmarks_->add(view.bookmarks);
  travel_->ask([this, &store = travel_->store(), view]() -> Worker::Done {
    return [this, cells = viewCellsOf(view, store)] {
      choice_.show(cells.states);
      choice_.choose(cells.chosen);
      if (!cells.note.empty()) messages_.say(cells.note);
    };
  });
}

}  // namespace filiform::internal
