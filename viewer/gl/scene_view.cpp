#include "viewer/gl/scene_view.h"

#include "index/errors.h"
#include "viewer/gl/internal/batch_loader.h"
#include "viewer/scene/overlay.h"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <limits>
#include <set>
#include <unordered_map>

namespace filiform {

namespace {

using Clock = std::chrono::steady_clock;
using Node = std::uint32_t;  // a level tile, or behind all of them a tile in full resolution
constexpr Node kNone = std::numeric_limits<Node>::max();

// Marks lie behind all threads' ids.
constexpr Renderer::BatchId kMarks = Renderer::BatchId{1} << 40, kCell = kMarks + 3, kMarksEnd = kCell + 1;

// A tile that cannot be read is tried again after so long.
constexpr double kRetry_s = 5;
// Of the other cells' colours, where one is highlighted.
constexpr double kReceding = 0.7;
// Of the scene's depth: what lies so far behind its neighbour is darkest.
constexpr double kShadePart = 0.08;
// Nothing is loaded or dropped for a camera that trembles by less.
constexpr double kTremble_px = 0.05;
// The proxy's ball is drawn anew when it is that far from where it was drawn: a hand that trembles is at rest. Farther,
// and the hand moves.
constexpr double kProxyTremble_px = 0.3, kProxyMoves_px = 1;

double since_ms(Clock::time_point start) {
  return std::chrono::duration<double, std::milli>(Clock::now() - start).count();
}

std::string reasonOf(const std::exception_ptr& error) {
  try {
    std::rethrow_exception(error);
  } catch (const std::exception& e) {
    return e.what();
  } catch (...) {
    return "unknown reason";
  }
}

// What a picture depends on beside the tiles: equal lists give equal pictures.
class Signature {
 public:
  void add(double x) { values_.push_back(x); }
  template <class Derived>
  void add(const Eigen::MatrixBase<Derived>& m) {
    for (Eigen::Index i = 0; i < m.size(); ++i) add(static_cast<double>(m(i % m.rows(), i / m.rows())));
  }
  void add(const Rgba& c) { add(((c.r * 256.0 + c.g) * 256.0 + c.b) * 256.0 + c.a); }
  friend bool operator==(const Signature&, const Signature&) = default;

 private:
  std::vector<double> values_;
};

}  // namespace

SceneBudget SceneBudget::of(const std::string& renderer_description) {
  if (!isSoftwareRenderer(renderer_description)) return {};
  return {.segments = 200'000,
          .moving_segments = 50'000,
          .samples = 2,
          .moving_samples = 1,
          .moving_shade = false,
          .upload_bytes = 1U << 20,
          .card_bytes = 256U << 20};
}

struct SceneView::Impl {
  Impl(const TileStore& s, const Levels* l, Renderer& r);

  struct Held {  // a tile that was wanted or loaded
    bool uploaded = false;
    std::uint32_t generation = 0;
    std::uint64_t implausible = 0;
    std::uint64_t used = 0;  // the frame in which it was wanted or drawn last
    std::exception_ptr error;
    double retry_s = 0;
  };

  const TileStore& store;
  const Levels* levels;
  Renderer& renderer;
  Node first_tile;           // level tiles come before
  std::vector<Node> parent;  // the level tile right above, kNone for roots
  Vector3d lo_W, hi_W;
  std::unique_ptr<internal::BatchLoader> loader;

  std::unordered_map<Node, Held> held;
  DrawList chosen;
  LevelView chosen_view;
  std::vector<Node> shown;  // ascending
  std::uint64_t frame = 0;
  std::uint32_t generation = 0;
  ColourBy colour = ColourBy::cell;
  // The highlighted cell: one batch, under the key kNone.
  std::optional<std::uint32_t> cell;
  Held cell_held;

  std::optional<Camera> camera;                     // of the last frame
  std::optional<Vector3d> proxy_W, proxy_rested_W;  // as drawn; where it was when it moved last
  double moved_s = -1e300, last_s = 0;
  SeparationFilter separation;
  Signature last_choice, last_picture;
  bool has_picture = false, changed = true, wish_again = false;
  double next_retry_s = INFINITY;
  SceneFigures figures;

  Node nodeOf(const LevelPart& part) const { return part.level ? part.tile : first_tile + part.tile; }
  bool isLevel(Node node) const { return node < first_tile; }
  bool isUploaded(Node node) const {
    const auto found = held.find(node);
    return found != held.end() && found->second.uploaded;
  }
  bool isMoving(const SceneFrame& frame);
  void choose(const SceneFrame& frame, const LevelView& view, const Camera& fitted, bool moving, bool with_stand_ins);
  void want(bool with_stand_ins, double now_s);
  bool upload(const SceneFrame& frame, bool all);
  void selectShown();
  void evict(const SceneBudget& budget);
  void count();
  void putMarks(const SceneFrame& frame, const Camera& fitted, const PictureSize& eye);
  void prepare(const SceneFrame& frame, bool whole);
  void picture(const SceneFrame& frame);
  std::size_t countWhole();
  void takeOff();
  bool whole_begun = false, whole_drawing = false;  // advanceWhole()

  // Of the frame under way.
  Camera fitted;
  RenderOptions options;
  std::array<EyeView, 2> views;
  PictureSize eye;
  bool moving = false;
};

SceneView::Impl::Impl(const TileStore& s, const Levels* l, Renderer& r)
    : store(s), levels(l), renderer(r), first_tile(l != nullptr ? l->size() : 0) {
  GridBox box;
  for (TileId tile = 0; tile < store.tile_count(); ++tile)
    if (!store.entry(tile).content.empty()) box.extend(store.entry(tile).content);
  if (box.empty()) throw InputError("there is nothing to draw: the scene has no segment");
  const Vector3d rim = Vector3d::Constant(kDrawnUnknownSoma_um);  // the box is that of the samples' middles
  lo_W = store.grid().toWorld(box.lo) - rim;
  hi_W = store.grid().toWorld(box.hi) + rim;
  parent.assign(std::size_t{first_tile} + store.tile_count(), kNone);
  for (LevelId level = 0; level < first_tile; ++level)
    for (const LevelPart& part : levels->below(level)) parent[nodeOf(part)] = level;
  loader = std::make_unique<internal::BatchLoader>(store, levels, hi_W.y(), lo_W.y());
}

SceneView::SceneView(const TileStore& store, const Levels* levels, Renderer& renderer)
    : impl_(std::make_unique<Impl>(store, levels, renderer)) {}

void SceneView::Impl::takeOff() {
  for (const auto& [node, tile] : held) renderer.remove(node);
  for (Renderer::BatchId mark = kMarks; mark < kMarksEnd; ++mark) renderer.remove(mark);
  held.clear();
}

SceneView::~SceneView() { impl_->takeOff(); }

std::shared_ptr<void> SceneView::end() {
  impl_->takeOff();
  impl_->loader->stop();
  return std::shared_ptr<internal::BatchLoader>(std::move(impl_->loader));
}

const Vector3d& SceneView::lo_W() const noexcept { return impl_->lo_W; }
const Vector3d& SceneView::hi_W() const noexcept { return impl_->hi_W; }
bool SceneView::waitForTiles(double most_s) { return impl_->loader->wait(most_s); }

bool SceneView::Impl::isMoving(const SceneFrame& f) {
  const Camera& now = f.camera;
  bool moved = !camera;
  if (camera) {
    const double px_rad = f.size.height / (2 * std::tan(now.height_angle_rad / 2));
    const double shift_px = (now.eye_W - camera->eye_W).norm() / std::max(now.focus_um, 1e-12) * px_rad;
    const double turn_px = (now.rotation_VW - camera->rotation_VW).norm() * px_rad;
    moved = shift_px > kTremble_px || turn_px > kTremble_px || now.height_angle_rad != camera->height_angle_rad;
  }
  if (moved) {
    camera = now;
    moved_s = f.time_s;
  }
  if (f.proxy_W) {
    const double px_um = f.size.height / (2 * std::tan(now.height_angle_rad / 2)) / std::max(now.focus_um, 1e-12);
    const auto isBeyond = [&](const std::optional<Vector3d>& from, double most_px) {
      return !from || (*f.proxy_W - *from).norm() * px_um > most_px;
    };
    if (isBeyond(proxy_W, kProxyTremble_px)) proxy_W = f.proxy_W;
    if (isBeyond(proxy_rested_W, kProxyMoves_px)) {
      proxy_rested_W = f.proxy_W;
      moved_s = f.time_s;
    }
  } else {
    proxy_W.reset();
  }
  return f.moving ? *f.moving : f.time_s - moved_s < SceneFrame::kRest_s;
}

void SceneView::Impl::choose(const SceneFrame& f, const LevelView& view, const Camera& at, bool is_moving,
                             bool with_stand_ins) {
  const std::uint64_t most = is_moving ? f.budget.moving_segments : f.budget.segments;
  Signature choice;
  choice.add(view.eye_W);
  for (const LevelView::Plane& plane : view.planes) choice.add(plane.n), choice.add(plane.d);
  choice.add(view.pixels_per_rad);
  choice.add(at.focus_W());
  choice.add(static_cast<double>(most));
  choice.add(f.budget.enough_px);
  if (choice == last_choice) return;
  last_choice = std::move(choice);
  chosen = chooseTiles(store, levels, view, at.focus_W(), most, f.budget.enough_px);
  chosen_view = view;
  want(with_stand_ins, f.time_s);
  changed = true;
}

// Asks for what is chosen and not there, what stands in on the way included: first where the error that is seen now is
// the largest.
void SceneView::Impl::want(bool with_stand_ins, double now_s) {
  struct Wish {
    double error_px;  // of what is seen without it
    Node node;
  };
  std::vector<Wish> wishes;
  std::set<Node> met;
  next_retry_s = INFINITY;
  const auto wish = [&](Node node) {
    Held& tile = held[node];
    tile.used = frame;
    if (tile.uploaded && tile.generation == generation) return;
    if (tile.error && tile.retry_s > now_s) {
      next_retry_s = std::min(next_retry_s, tile.retry_s);
      return;
    }
    const Node above = parent[node];
    const double error_px = above == kNone ? INFINITY : levels->errorOnScreen(above, chosen_view);
    wishes.push_back({error_px, node});
  };
  for (const LevelPart& part : chosen.parts) {
    wish(nodeOf(part));
    if (!with_stand_ins) continue;
    for (Node above = parent[nodeOf(part)]; above != kNone && met.insert(above).second; above = parent[above])
      wish(above);
  }
  // Level tiles come before those inside them, and without levels the nearest come first already.
  std::stable_sort(wishes.begin(), wishes.end(), [&](const Wish& a, const Wish& b) {
    if (a.error_px != b.error_px) return a.error_px > b.error_px;
    return std::min(a.node, first_tile) < std::min(b.node, first_tile);
  });
  std::vector<internal::TileJob> jobs;
  jobs.reserve(wishes.size() + 1);
  if (cell && !(cell_held.uploaded && cell_held.generation == generation) && !cell_held.error)
    jobs.push_back({.key = kNone, .generation = generation, .colour = colour, .whole_cell = *cell});
  for (const Wish& w : wishes)
    jobs.push_back({.key = w.node,
                    .generation = generation,
                    .level = isLevel(w.node),
                    .tile = isLevel(w.node) ? w.node : w.node - first_tile,
                    .colour = colour});
  loader->want(std::move(jobs));
}

// True when a tile came.
bool SceneView::Impl::upload(const SceneFrame& f, bool all) {
  const Clock::time_point start = Clock::now();
  bool came = false;
  internal::LoadedTile loaded;
  figures.uploads = 0;
  figures.upload_bytes = 0;
  while (figures.uploads == 0 || all ||
         (figures.upload_bytes < f.budget.upload_bytes && since_ms(start) < f.budget.upload_ms)) {
    if (!loader->take(loaded)) break;
    if (loaded.job.generation != generation) continue;
    const bool is_cell = loaded.job.key == kNone;
    const auto found = held.find(loaded.job.key);
    if (is_cell ? cell != loaded.job.whole_cell : found == held.end()) continue;
    Held& tile = is_cell ? cell_held : found->second;
    came = true;
    tile.error = loaded.error;
    if (loaded.error) {
      tile.retry_s = f.time_s + kRetry_s;
      next_retry_s = std::min(next_retry_s, tile.retry_s);
      continue;
    }
    if (is_cell) {
      renderer.put(kCell, loaded.batch, Layer::highlight);
    } else {
      renderer.put(loaded.job.key, loaded.batch);
      renderer.show(loaded.job.key, std::binary_search(shown.begin(), shown.end(), loaded.job.key));
    }
    tile.uploaded = true;
    tile.generation = generation;
    tile.implausible = loaded.batch.implausible_radii;
    ++figures.uploads;
    figures.upload_bytes += loaded.batch.segments.size() * sizeof(DrawnSegment);
  }
  figures.upload_ms = figures.uploads > 0 ? since_ms(start) : 0;
  return came;
}

// For each place the tile that was chosen, else the innermost coarser one that is there, else finer ones.
void SceneView::Impl::selectShown() {
  std::set<Node> now;
  std::vector<Node> missing;
  for (const LevelPart& part : chosen.parts) {
    const Node node = nodeOf(part);
    if (isUploaded(node)) {
      now.insert(node);
      continue;
    }
    Node above = held[node].error ? kNone : parent[node];  // one that cannot be read does not take its neighbours along
    while (above != kNone && !isUploaded(above)) above = parent[above];
    if (above != kNone)
      now.insert(above);
    else
      missing.push_back(node);
  }
  for (const Node node : missing) {
    if (!isLevel(node)) continue;
    for (const auto& [below, tile] : held) {
      if (!tile.uploaded) continue;
      Node above = parent[below];
      while (above != kNone && above != node) above = parent[above];
      if (above == node) now.insert(below);
    }
  }
  // Each place once.
  std::vector<Node> next;
  for (const Node node : now) {
    Node above = parent[node];
    while (above != kNone && !now.contains(above)) above = parent[above];
    if (above == kNone) next.push_back(node);
  }
  for (const Node node : next) held[node].used = frame;
  if (next == shown) return;
  for (const Node node : shown)
    if (!std::binary_search(next.begin(), next.end(), node)) renderer.show(node, false);
  for (const Node node : next)
    if (!std::binary_search(shown.begin(), shown.end(), node)) renderer.show(node, true);
  shown = std::move(next);
}

// Of those neither drawn nor wanted, what was used least lately.
void SceneView::Impl::evict(const SceneBudget& budget) {
  if (renderer.bytes() <= budget.card_bytes) return;
  std::set<Node> kept(shown.begin(), shown.end()), stand_ins;
  for (const LevelPart& part : chosen.parts) {
    kept.insert(nodeOf(part));
    for (Node node = parent[nodeOf(part)]; node != kNone && stand_ins.insert(node).second;) node = parent[node];
  }
  kept.merge(stand_ins);
  std::vector<std::pair<std::uint64_t, Node>> others;
  for (const auto& [node, tile] : held)
    if (!kept.contains(node)) others.emplace_back(tile.used, node);
  std::sort(others.begin(), others.end());
  for (const auto& [used, node] : others) {
    if (renderer.bytes() <= budget.card_bytes) return;
    renderer.remove(node);
    held.erase(node);
  }
}

void SceneView::Impl::count() {
  std::set<Node> wanted;
  figures.segments = figures.left_out = figures.implausible_radii = 0;
  figures.error_px = 0;
  figures.wanted_error_px = chosen.error_px;
  figures.tiles = static_cast<std::uint32_t>(shown.size());
  figures.stand_ins = figures.pending = 0;
  figures.left_out = levels == nullptr ? chosen.left_out : 0;
  figures.tiles_left_out = chosen.tiles_left_out;
  figures.failed.clear();
  figures.has_gaps = false;
  for (const LevelPart& part : chosen.parts) {
    const Node node = nodeOf(part);
    wanted.insert(node);
    const Held& tile = held[node];
    if (tile.error)
      figures.failed.push_back(reasonOf(tile.error));
    else if (!tile.uploaded || tile.generation != generation)
      ++figures.pending;
    bool stands = false;
    for (Node above = node; above != kNone && !stands; above = parent[above])
      stands = std::binary_search(shown.begin(), shown.end(), above);
    if (stands) continue;
    figures.has_gaps = true;
    if (!part.level) {
      figures.left_out += store.entry(part.tile).owned;
    } else {
      const LevelEntry& entry = levels->entry(part.tile);
      figures.left_out += entry.represented + entry.dropped;
    }
  }
  for (const Node node : shown) {
    const Held& tile = held[node];
    figures.segments += isLevel(node) ? levels->entry(node).segments : store.entry(node - first_tile).owned;
    figures.implausible_radii += tile.implausible;
    if (!wanted.contains(node)) ++figures.stand_ins;
    if (!isLevel(node)) continue;
    figures.left_out += levels->entry(node).dropped;
    figures.error_px = std::max(figures.error_px, levels->errorOnScreen(node, chosen_view));
  }
  if (cell && cell_held.error) {
    std::string line = "the highlighted cell: ";
    line += reasonOf(cell_held.error);
    figures.failed.push_back(std::move(line));
  }
  if (cell && !cell_held.error && !(cell_held.uploaded && cell_held.generation == generation)) ++figures.pending;
  figures.complete = figures.pending == 0 && figures.stand_ins == 0 && figures.failed.empty();
  figures.card_bytes = renderer.bytes();
}

void SceneView::Impl::putMarks(const SceneFrame& f, const Camera& at, const PictureSize& eye_size) {
  const double px_rad = pixelsPerRadian(viewOf(at, eye_size.aspect()).frustum, eye_size);
  const double scale = f.mark_scale > 0 ? f.mark_scale : std::max(1.0, eye_size.height / 800.0);
  const double um_px = at.focus_um / px_rad * scale;
  const auto put = [&](int mark, bool there, const auto& make) {
    const Renderer::BatchId id = kMarks + static_cast<Renderer::BatchId>(mark);
    if (there)
      renderer.put(id, make(), Layer::marks);
    else
      renderer.remove(id);
  };
  put(0, f.workspace != nullptr, [&] { return workspaceBatch(*f.workspace, 1.6 * um_px); });
  put(1, proxy_W.has_value(), [&] { return proxyBatch(*proxy_W, 7 * um_px); });
  const GlyphPalette& palette = f.stereo == StereoMode::anaglyph ? kForGlasses : f.palette;
  put(2, f.junction != nullptr, [&] { return glyphBatch(*f.junction, 120 * um_px, 6 * um_px, palette); });
}

// Camera, depth cues, eyes, and which tiles are wanted.
void SceneView::Impl::prepare(const SceneFrame& f, bool whole) {
  ++frame;
  eye = eyeSize(f.stereo, f.size);
  const bool is_moving = isMoving(f);
  moving = !whole && is_moving;
  if (f.colour != colour) {
    colour = f.colour;
    ++generation;
    wish_again = changed = true;
  }
  if (f.cell != cell) {
    cell = f.cell;
    cell_held = {};
    renderer.remove(kCell);
    wish_again = changed = true;
  }

  // Depths within which things are: the workspace's, or all.
  options = {.size = f.size, .stereo = f.stereo, .samples = moving ? f.budget.moving_samples : f.budget.samples};
  const Camera asked = f.orthographic ? parallel(f.camera) : f.camera;
  if (cell) options.dim = kReceding;
  double nearest_um = 0, farthest_um = 0;
  if (f.workspace != nullptr) {
    fitted = asked;
    const double half_um = f.workspace->zoom_um() / 2;
    nearest_um = std::max(fitted.near_um, fitted.focus_um - half_um);
    farthest_um = fitted.focus_um + half_um;
    options.fog_begin_um = fitted.focus_um - half_um / 2;
    options.fog_end_um = fitted.far_um;
    options.fog_most = 1;
    options.clear_end_um = fitted.focus_um - 1.5 * half_um;
    options.clear_begin_um = nearest_um;
  } else {
    const Camera tight = fitDepth(asked, lo_W, hi_W);
    nearest_um = tight.near_um;
    farthest_um = tight.far_um;
    const Vector3d rim = Vector3d::Constant(kThickestSoma_um);
    fitted = fitDepth(asked, lo_W - rim, hi_W + rim);
    options.fog_begin_um = nearest_um;
    options.fog_end_um = farthest_um;
    options.fog_most = 0.5;
    if (!moving || f.budget.moving_shade) options.shade_um = kShadePart * (farthest_um - nearest_um);
  }
  double ratio = 0;
  if (f.stereo != StereoMode::mono) {
    const double width_tan = std::tan(fitted.height_angle_rad / 2) * eye.aspect();
    ratio = separation.follow(separationRatio(f.eyes, fitted.focus_um, nearest_um, farthest_um, width_tan),
                              f.time_s - last_s);
  }
  last_s = f.time_s;
  figures.separation = ratio;
  figures.moving = moving;
  views = stereoViews(fitted, eye.aspect(), ratio, f.eyes.widening);

  // One list for both eyes, whose views differ by a hand's breadth: wide enough for both.
  EyeView both = views[0];
  both.eye_W = fitted.eye_W;
  both.frustum.right = std::max(-both.frustum.left, both.frustum.right) * (1 + 2 * ratio);
  both.frustum.left = -both.frustum.right;
  if (!f.frozen || last_choice == Signature{}) choose(f, levelView(both, eye), fitted, moving, !whole);
  if (whole || wish_again || f.time_s >= next_retry_s) want(!whole, f.time_s);
  wish_again = false;
}

void SceneView::Impl::picture(const SceneFrame& f) {
  if (changed) {
    selectShown();
    evict(f.budget);
  }
  Signature now;
  for (const EyeView& view : views) {
    now.add(view.eye_W);
    now.add(view.rotation_VW);
    for (const double x : {view.frustum.left, view.frustum.right, view.frustum.bottom, view.frustum.top,
                           view.frustum.near_um, view.frustum.far_um})
      now.add(x);
  }
  for (const int x : {f.size.width, f.size.height, static_cast<int>(f.stereo), options.samples}) now.add(x);
  now.add(f.mark_scale);
  now.add(options.shade_um);
  if (f.workspace != nullptr) {
    now.add(f.workspace->centre_W());
    now.add(f.workspace->rotationMatrix());
    now.add(f.workspace->zoom_um());
  }
  if (proxy_W) now.add(*proxy_W);
  if (f.junction != nullptr) {
    now.add(f.junction->p_W);
    now.add(f.palette.own);
    now.add(f.palette.other);
    for (const Branch& branch : f.junction->branches) {
      now.add(branch.own ? 1 : 0);
      now.add(branch.points_W.back());
    }
  }
  figures.redrawn = changed || !has_picture || !(now == last_picture);
  if (!figures.redrawn) return;
  putMarks(f, fitted, eye);
  figures.drawn = renderer.draw(views, options);
  last_picture = std::move(now);
  has_picture = true;
  changed = false;
  count();
}

SceneFigures SceneView::draw(const SceneFrame& f) {
  impl_->prepare(f, false);
  if (impl_->upload(f, false)) impl_->changed = true;
  impl_->picture(f);
  return impl_->figures;
}

SceneFigures SceneView::drawWhole(const SceneFrame& f,
                                  const std::function<void(std::size_t done, std::size_t all)>& progress) {
  impl_->prepare(f, true);
  const std::size_t all = impl_->chosen.parts.size() + (impl_->cell ? 1 : 0);
  for (;;) {
    const std::size_t done = impl_->countWhole();
    if (progress) progress(done, all);
    if (done == all) break;
    impl_->loader->wait(0.1);
    impl_->upload(f, true);
  }
  impl_->changed = true;
  impl_->picture(f);
  return impl_->figures;
}

// How much is there of what the whole picture needs.
std::size_t SceneView::Impl::countWhole() {
  const auto isThere = [this](const Held& tile) {
    if (tile.error) std::rethrow_exception(tile.error);
    return tile.uploaded && tile.generation == generation;
  };
  std::size_t done = cell && isThere(cell_held) ? 1 : 0;
  for (const LevelPart& part : chosen.parts) done += isThere(held[nodeOf(part)]) ? 1 : 0;
  return done;
}

double SceneView::advanceWhole(const SceneFrame& f, double most_ms) {
  constexpr double kLoading = 0.5;  // the part of it that is loading
  Impl& s = *impl_;
  if (s.whole_drawing) {
    const double part = s.renderer.advance(most_ms);
    s.whole_drawing = part < 1;
    return kLoading + (1 - kLoading) * part;
  }
  if (!std::exchange(s.whole_begun, true)) s.prepare(f, true);
  s.upload(f, false);
  const std::size_t all = s.chosen.parts.size() + (s.cell ? 1 : 0), done = s.countWhole();
  if (done < all) return kLoading * static_cast<double>(done) / static_cast<double>(all);
  s.selectShown();
  s.putMarks(f, s.fitted, s.eye);
  s.figures.drawn = s.renderer.begin(s.views, s.options);
  s.count();
  s.has_picture = s.whole_begun = false;
  s.whole_drawing = true;
  return kLoading;
}

}  // namespace filiform
