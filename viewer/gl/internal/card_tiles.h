// The tiles of a scene on the graphics card. Chooses the tiles of a view, requests those that are missing, uploads
// loaded ones within the limits of a frame, shows each place once, and removes unused tiles when the card is full.
//
// A *stand-in* is a coarser or finer tile that is shown while the chosen tile is missing.
// Thread rule: the thread of the renderer's context.
#pragma once

#include "viewer/gl/internal/batch_loader.h"
#include "viewer/gl/internal/signature.h"
#include "viewer/gl/renderer.h"
#include "viewer/gl/scene_frame.h"
#include "viewer/scene/draw_list.h"

#include <cmath>
#include <cstdint>
#include <exception>
#include <limits>
#include <map>
#include <memory>
#include <optional>
#include <unordered_map>
#include <utility>
#include <vector>

namespace filiform::internal {

class CardTiles {
 public:
  // Batch ids from here on are free for the caller.
  static constexpr Renderer::BatchId kFirstFreeId = Renderer::BatchId{1} << 40;

  // Store, levels (may be nullptr) and renderer must outlive it. The two depths are the ends of ColourBy::depth's ramp.
  CardTiles(const TileStore& store, const Levels* levels, Renderer& renderer, double shallow_um, double deep_um);

  // Starts a frame. Sets its colours, the states of cells and the highlighted cells. True: the picture changes. Colours
  // and states upload no segment. Few cells that alone are not hidden are loaded whole then, and replace all tiles.
  bool setAppearance(const SceneFrame& frame);
  std::uint64_t palettes() const { return palettes_; }  // that were set so far
  // Chooses tiles as chooseTiles() does, and requests those that are missing, stand-ins only if `with_stand_ins`.
  // True: the choice is a new one. Does nothing for the arguments of the last call, unless more of the set's directory
  // was read since. With stand-ins it reads nothing: the loading thread reads the directory where finer tiles need it,
  // and a page that cannot be read is tried again like a tile. O(tiles in the picture; without levels all tiles).
  bool choose(const LevelView& view, const Vector3d& focus_W, std::uint64_t most_segments, double enough_px,
              bool with_stand_ins, double now_s);
  bool hasChosen() const { return !last_choice_.empty(); }
  // Requests the chosen tiles again if the appearance changed or a failed tile is due.
  void requestIfDue(bool with_stand_ins, double now_s);
  // Requests all chosen tiles that are missing, the one with the largest error on the screen first; last the parts of
  // the directory that finer tiles need.
  void request(bool with_stand_ins, double now_s);

  // Uploads loaded tiles, one at least, until the bytes or milliseconds of the budget are used up; `all`: without
  // limits. Sets `uploads`, `upload_bytes` and `upload_ms` of the figures. True: a tile came.
  bool upload(const SceneBudget& budget, bool all, double now_s, SceneFigures& figures);
  // Selects for each place the chosen tile, else the finest coarser one, else finer ones, and has the renderer show
  // these alone.
  void selectShown();
  // True if a tile that is shown, or the highlighted cell, changed since the last call: the picture differs.
  bool takeChangeOfShown() { return std::exchange(shown_changed_, false); }
  // Removes tiles that are neither shown nor wanted, least recently used first, until `most_bytes` suffice.
  void evict(std::uint64_t most_bytes);
  // Sets the figures that count tiles and segments.
  void count(SceneFigures& figures);

  // For a whole picture: the number of batches that it needs, and of those that are uploaded. The latter throws the
  // reason of a tile that cannot be read.
  std::size_t wholeSize() const { return chosen_.parts.size() + cells_.size(); }
  std::size_t wholeDone();

  // Removes all tiles from the renderer.
  void removeAll();
  bool waitForTiles(double most_s) { return loader_->wait(most_s); }
  // Stops the loading thread, and returns it. Its destructor waits for the tile that is being read.
  std::shared_ptr<void> end();

 private:
  using Node = std::uint32_t;  // a level tile, or, from first_tile_ on, a tile in full resolution
  static constexpr Node kNone = std::numeric_limits<Node>::max();
  static constexpr Renderer::BatchId kFirstCell = kFirstFreeId / 2;  // of whole cells

  struct Slot {  // a tile that was requested or uploaded
    bool uploaded = false;
    std::uint64_t implausible = 0;
    std::uint64_t used = 0;  // the frame in which it was last wanted or shown
    std::exception_ptr error;
    double retry_s = 0;
  };

  Node nodeOf(const LevelPart& part) const { return part.level ? part.tile : first_tile_ + part.tile; }
  bool isLevel(Node node) const { return node < first_tile_; }
  bool isUploaded(Node node) const {
    const auto found = slots_.find(node);
    return found != slots_.end() && found->second.uploaded;
  }
  Node above(Node node) const;                                 // the level tile right above, kNone for roots
  bool tookDirectory(const LoadedTile& loaded, double now_s);  // true: the figures or the choice may change
  void countChosen(SceneFigures& figures);
  void findLone();                                        // of these states
  bool setWhole(const SceneFrame& frame);                 // true: other cells, or others of them highlighted
  bool hasLone() const;                                   // all of them are uploaded
  void leaveHidden(std::vector<LevelPart>& parts) const;  // leaves out parts in which all cells are hidden

  const TileStore& store_;
  const Levels* levels_;
  Renderer& renderer_;
  Node first_tile_;
  std::unique_ptr<BatchLoader> loader_;

  std::unordered_map<Node, Slot> slots_;
  DrawList chosen_;
  LevelView chosen_view_;
  std::unordered_map<LevelId, Slot> unread_;  // levels below which the directory could not be read
  bool choose_again_ = false;                 // more of the directory was read
  std::uint64_t chosen_frame_ = 0;            // the last frame that was not frozen
  Signature last_choice_;
  std::vector<Node> shown_;  // ascending
  bool shown_changed_ = false;
  std::uint64_t frame_ = 0;
  double shallow_um_, deep_um_;
  std::uint64_t palettes_ = 0;
  std::uint8_t hidden_types_ = 0;
  ColourBy colour_ = ColourBy::cell;
  std::shared_ptr<const CellColours> cell_colours_;
  std::shared_ptr<const CellStates> states_;
  struct WholeCell : Slot {
    Layer layer = Layer::neurites;
  };
  std::map<std::uint32_t, WholeCell> cells_;  // drawn whole: a batch each, requested under the key kNone
  std::vector<std::uint32_t> highlighted_;    // of the last frame
  std::vector<std::uint32_t> lone_;           // the cells that are not hidden, if these are few and small; ascending
  std::vector<GridBox> boxes_;                // of the cells that are not hidden; empty: of all, or too many
  bool request_again_ = false;
  double next_retry_s_ = INFINITY;
};

}  // namespace filiform::internal
