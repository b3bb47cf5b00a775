// The scene that is open in the window: the user's travel through it, the view of it, its picture and its tiles.
// Thread rule: the window's thread.
#pragma once

#include "viewer/gl/scene_view.h"
#include "viewer/scene/view_state.h"
#include "viewer/window/panels/internal/attribute_view.h"
#include "viewer/window/panels/internal/cell_choice.h"
#include "viewer/window/panels/internal/cell_table.h"
#include "viewer/window/panels/internal/contact_view.h"
#include "viewer/window/panels/internal/tile_census.h"
#include "viewer/window/panels/panels.h"
#include "viewer/window/settings/internal/messages.h"
#include "viewer/window/settings/settings.h"
#include "viewer/window/travel/companion.h"
#include "viewer/window/travel/internal/bookmarks.h"
#include "viewer/window/travel/internal/opening.h"
#include "viewer/window/travel/internal/travel.h"
#include "viewer/window/travel/internal/viewpoint.h"

#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include <nlohmann/json_fwd.hpp>

namespace filiform::internal {

class OpenScene {
 public:
  // Requires a picture and a session. Messages must outlive it.
  OpenScene(Opened opened, Messages& messages, Travel::Callbacks callbacks);

  Travel& travel() { return *travel_; }
  const Travel& travel() const { return *travel_; }
  Viewpoint& viewpoint() { return viewpoint_; }
  const NavigationSnapshot& now() const { return travel_->now(); }
  const EyeView& view() const { return view_; }  // as look() found it
  const SceneFigures& figures() const { return figures_; }
  const TilePanel& tiles() const { return tiles_; }
  const AttributeView& attributes() const { return *attributes_; }
  bool hasLostNetwork() const;

  // These say what went wrong, or set `error`.
  void serveAttributes(const PanelRequests& requests);
  // A click on a value of the legend of types: this one alone, or added or left out; again: all.
  void toggleType(const std::string& value, bool alone);
  bool selectCells(const std::string& condition, std::string& error);  // false: none
  // The next attribute to colour by. False: the colouring of the settings is the next one. Attributes follow the last.
  bool nextColouring(ColourBy settings);
  // By an attribute, or by `measure:FEATURE`, which measures the cells first; empty: as the settings say.
  void colourBy(const std::string& name);

  // Once a frame, before fill(): opens and closes the panels of cells and contacts, and takes up their work.
  void servePanels(const OpenPanels& open);
  const CellTable& cells() const { return *cells_; }
  // Chosen cells are highlighted instead of the proxy's. A jump to another cell ends the choice of a single one.
  CellChoice& choice() { return choice_; }
  const CellChoice& choice() const { return choice_; }
  Bookmarks& bookmarks() { return *bookmarks_; }
  // Writes what is shown to a new file in the folder, and copies the command that shows it again.
  void saveView(const Settings& settings, const PictureSize& size, const std::string& folder);
  // Shows cells, bookmarks, turn and overview of the view. Names that the scene does not have are counted.
  void show(const ViewState& view);
  // The text that was to be copied since the last call; empty: none.
  std::string takeCopied() { return std::exchange(copied_, {}); }
  // `folder`: for tables.
  void serveBookmarks(const BookmarkRequests& asked, const std::string& folder);
  // Isolates, hides, dims, inverts or shows cells: the chosen ones, else the proxy's. False: the action is none of
  // these.
  bool actOnCells(Action action, std::optional<std::uint32_t> cell = {});
  // Those of the proxy's cell. These two say why they cannot do it.
  void findContacts(double within_um);
  void jumpAcross(std::optional<std::size_t> site = {});  // none: the site nearest to the proxy
  const ContactView& contacts() const { return *contacts_; }

  void nextOverview();
  // Turns and zooms the overview, or else the workspace.
  void turn(const Turn& turn);
  void zoom(double factor);

  // Once a frame, before look(): who travels elsewhere.
  void accompany(const std::optional<Companion>& companion) { companion_ = companion; }
  // The view is the companion's: the mouse then points at nothing of this hand.
  bool goesAlong() const { return companion_ && companion_->along; }
  // Once a frame: the camera of this frame.
  void look(const PictureSize& size, bool orthographic, double now_s);
  // Counts tiles and rates, four times a second; lists the tiles near the proxy if `listed`.
  void countTiles(bool listed, double now_s);
  // The frame with camera, workspace, proxy, fork, highlighted cell and ground; the caller sets the rest. `own_cell`:
  // inside, the proxy's cell is highlighted if no other is chosen.
  SceneFrame frame(bool own_cell, Theme theme);
  // Draws the frame, and says once if tiles are left out because the scene has no levels.
  void draw(const SceneFrame& frame);

  // Sets the fields of the panels and of the state that are of the scene. `colouring`: of the settings.
  void fill(PanelData& data, const PictureSize& size, ColourBy colouring);
  void describe(nlohmann::ordered_json& state, const PictureSize& size) const;

  // Returns the work that ends the session and the loading thread; it may wait for the disk or the device, and may run
  // on any thread. Afterwards only the destructor may be called.
  std::function<void()> end();

 private:
  SceneFrame frameOf(bool own_cell, Theme theme);
  Messages& messages_;
  std::shared_ptr<Travel> travel_;
  Viewpoint viewpoint_;
  std::unique_ptr<AttributeView> attributes_;
  std::unique_ptr<SceneView> picture_;     // destroyed before travel_, which owns the tiles
  std::shared_ptr<CellTable> cells_;       // likewise
  std::shared_ptr<ContactView> contacts_;  // likewise
  std::unique_ptr<Bookmarks> bookmarks_;   // likewise
  std::string copied_;
  CellChoice choice_;
  std::vector<CellColours::Entry> types_ = legendOfTypes(), depths_;  // legends; types that are not chosen are hidden
  std::optional<std::uint32_t> own_cell_;                             // the proxy's
  std::vector<std::uint32_t> highlighted_;                            // in the last frame
  std::uint8_t hidden_types_ = 0;                                     // likewise
  const Feature* wanted_colours_ = nullptr;                           // as soon as they are measured
  std::optional<Companion> companion_;
  Camera camera_;
  EyeView view_;
  SceneFigures figures_;
  TilePanel tiles_;
  std::vector<NearTile> near_;  // tiles near the proxy
  double tiles_counted_s_ = -1;
  bool told_missing_levels_ = false;
};

}  // namespace filiform::internal
