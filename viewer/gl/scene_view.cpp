#include "viewer/gl/scene_view.h"

#include "index/errors.h"
#include "viewer/gl/internal/card_tiles.h"
#include "viewer/gl/internal/motion_detector.h"
#include "viewer/gl/internal/signature.h"
#include "viewer/scene/overlay.h"

#include <algorithm>
#include <array>
#include <chrono>
#include <cmath>
#include <utility>

namespace filiform {

namespace {

using internal::CardTiles;
using internal::Signature;
using Clock = std::chrono::steady_clock;

// Dims the other cells where one is highlighted.
constexpr double kReceding = 0.7;
// In motion, of the budget.
constexpr std::uint64_t kOwnPart = 4;
// Between two pictures of the same view that differ in the detail of their tiles alone, unless the last one is
// complete.
constexpr double kRefine_s = 1;
// A picture at rest that will take no more than so many parts is drawn at once.
constexpr double kAtOnce = 1.6;
// The first picture waits this long for a tile.
constexpr double kFirst_s = 0.3;
// Part of the scene's depth: a point that lies this far behind its neighbour on the screen is darkest.
constexpr double kShadePart = 0.08;

enum Overlay : Renderer::BatchId {
  kWorkspaceBoxes = CardTiles::kFirstFreeId,
  kProxyBall,
  kCompanionBall,
  kMarks,
  kStylusShaft,
  kForkGlyph,
  kOverlaysEnd
};

void addView(Signature& signature, const EyeView& view) {
  signature.add(view.eye_W);
  signature.add(view.rotation_VW);
  const Frustum& f = view.frustum;
  for (const double x : {f.left, f.right, f.bottom, f.top, f.near_um, f.far_um}) signature.add(x);
}

double since_ms(Clock::time_point begin) {
  return std::chrono::duration<double, std::milli>(Clock::now() - begin).count();
}

// One view for the choice of tiles, wide enough for both eyes.
EyeView viewForBothEyes(const EyeView& left, const Vector3d& middle_W, double separation_ratio) {
  EyeView both = left;
  both.eye_W = middle_W;
  both.frustum.right = std::max(-both.frustum.left, both.frustum.right) * (1 + 2 * separation_ratio);
  both.frustum.left = -both.frustum.right;
  return both;
}

GridBox boxOf(const TileStore& store) {
  GridBox box;
  const std::uint64_t tiles_of_group = std::uint64_t{store.page_tiles()} * store.group_pages();
  for (std::uint32_t group = 0; group * tiles_of_group < store.tile_count(); ++group)
    if (const GridBox content = store.groupContent(group); !content.empty()) box.extend(content);
  if (box.empty()) throw InputError("nothing to draw: the scene has no segment");
  return box;
}

// The box holds the samples' positions: somata reach beyond it.
const Vector3d kRoomForSomata_um = Vector3d::Constant(kDrawnUnknownSoma_um);

}  // namespace

struct SceneView::Impl {
  struct DepthRange {
    double nearest_um, farthest_um;
  };
  struct Detail {
    int samples, stretch;
    double shade_um;
    friend bool operator==(const Detail&, const Detail&) = default;
  };

  Impl(const TileStore& store, const Levels* levels, Renderer& r)
      : renderer(r),
        box(boxOf(store)),
        usual(store.usualBox()),
        lo_W(store.grid().toWorld(box.lo) - kRoomForSomata_um),
        hi_W(store.grid().toWorld(box.hi) + kRoomForSomata_um),
        usual_lo_W(store.grid().toWorld(usual.box.lo) - kRoomForSomata_um),
        usual_hi_W(store.grid().toWorld(usual.box.hi) + kRoomForSomata_um),
        tiles(store, levels, r, hi_W.y(), lo_W.y()) {}

  // Sets camera, depth cues and eyes of the frame, and requests the tiles that it needs.
  void prepare(const SceneFrame& f, bool whole);
  DepthRange fitDepths(const SceneFrame& f);
  void putOverlays(const SceneFrame& f);
  Signature signatureOf(const SceneFrame& f) const;
  bool isDue(const SceneFrame& f, const Signature& now);
  void draw(const SceneFrame& f);
  void advance(const SceneFrame& f, bool begins);
  bool isQuick(const SceneFrame& f) const;
  void stretchTo(const SceneFrame& f, int wanted);
  void drawInTime(const SceneFrame& f, Clock::time_point& begin);
  Detail detail() const { return {options.samples, stretch, options.shade_um}; }
  void removeAll();

  Renderer& renderer;
  GridBox box;
  UsualBox usual;
  Vector3d lo_W, hi_W, usual_lo_W, usual_hi_W;
  CardTiles tiles;
  internal::MotionDetector motion;
  SeparationFilter separation;
  double last_s = 0;
  std::shared_ptr<const std::vector<Vector3d>> marks_W;
  double marks_version = 0;
  Signature last_picture;
  bool has_picture = false, under_way = false;
  double drawn_ms = 0, rest_ms = INFINITY;  // of the picture under way; of the last one at rest
  double sample_ms = 0;                     // of the last one in motion, with a sample for each pixel of the screen
  std::uint64_t rest_segments = 0;
  bool changed = true;      // tiles, since they were last counted
  bool can_refine = false;  // the next picture of the same view shows other tiles, samples or shading
  Detail last_detail{};
  double last_picture_s = 0, first_s = INFINITY;
  SceneFigures counted;                             // the tiles that the next picture shows
  bool whole_begun = false, whole_drawing = false;  // advanceWhole()
  SceneFigures figures;

  // Set by prepare():
  Camera fitted;
  RenderOptions options;
  std::array<EyeView, 2> views;
  PictureSize eye;
  int stretch = 1;  // screen pixels across a pixel of the picture
  bool moving = false;
};

SceneView::SceneView(const TileStore& store, const Levels* levels, Renderer& renderer)
    : impl_(std::make_unique<Impl>(store, levels, renderer)) {}

void SceneView::Impl::removeAll() {
  tiles.removeAll();
  for (Renderer::BatchId id = kWorkspaceBoxes; id < kOverlaysEnd; ++id) renderer.remove(id);
}

SceneView::~SceneView() { impl_->removeAll(); }

std::shared_ptr<void> SceneView::end() {
  impl_->removeAll();
  return impl_->tiles.end();
}

const Vector3d& SceneView::lo_W() const noexcept { return impl_->lo_W; }
const Vector3d& SceneView::hi_W() const noexcept { return impl_->hi_W; }
const Vector3d& SceneView::usual_lo_W() const noexcept { return impl_->usual_lo_W; }
const Vector3d& SceneView::usual_hi_W() const noexcept { return impl_->usual_hi_W; }
std::uint64_t SceneView::far_segments() const noexcept { return impl_->usual.outside; }
bool SceneView::waitForTiles(double most_s) { return impl_->tiles.waitForTiles(most_s); }

// Sets the camera's near and far, and fog, fading and shading by the depths at which there is something to see: those
// of the workspace, or else of the whole scene. Returns these depths.
SceneView::Impl::DepthRange SceneView::Impl::fitDepths(const SceneFrame& f) {
  const Camera asked = f.orthographic ? parallel(f.camera) : f.camera;
  if (f.workspace != nullptr) {
    fitted = asked;
    const double half_um = f.workspace->zoom_um() / 2;
    const DepthRange range{std::max(fitted.near_um, fitted.focus_um - half_um), fitted.focus_um + half_um};
    options.fog_begin_um = fitted.focus_um - half_um / 2;
    options.fog_end_um = fitted.far_um;
    options.fog_most = 1;
    options.clear_end_um = fitted.focus_um - 1.5 * half_um;
    options.clear_begin_um = range.nearest_um;
    return range;
  }
  const Camera tight = fitDepth(asked, usual_lo_W, usual_hi_W);
  const DepthRange range{tight.near_um, tight.far_um};
  const Vector3d rim = Vector3d::Constant(kThickestSoma_um);
  fitted = fitDepth(asked, lo_W - rim, hi_W + rim);
  options.fog_begin_um = range.nearest_um;
  options.fog_end_um = range.farthest_um;
  options.fog_most = 0.5;
  if (!moving || f.budget.moving_shade) options.shade_um = kShadePart * (range.farthest_um - range.nearest_um);
  return range;
}

void SceneView::Impl::prepare(const SceneFrame& f, bool whole) {
  eye = eyeSize(f.stereo, f.size);
  const bool is_moving = motion.update(f);
  moving = !whole && is_moving;
  changed |= tiles.setAppearance(f);

  options = {.size = f.size,
             .stereo = f.stereo,
             .samples = moving ? f.budget.moving_samples : f.budget.samples,
             .background = f.background};
  if (!f.cells.empty()) options.dim = kReceding;
  if (moving) options.most_highlighted = f.budget.moving_segments / kOwnPart;
  stretchTo(f, moving ? f.budget.moving_stretch : 1);
  const DepthRange range = fitDepths(f);
  if (f.flat) options.fog_most = options.shade_um = 0;
  double ratio = 0;
  if (f.stereo != StereoMode::mono) {
    const double width_tan = std::tan(fitted.height_angle_rad / 2) * eye.aspect();
    ratio = separation.update(separationRatio(f.eyes, fitted.focus_um, range.nearest_um, range.farthest_um, width_tan),
                              f.time_s - last_s);
  }
  last_s = f.time_s;
  if (marks_W != f.marks_W) marks_W = f.marks_W, ++marks_version;
  figures.separation = ratio;
  figures.moving = moving;
  views = stereoViews(fitted, eye.aspect(), ratio, f.eyes.widening);

  if (!f.frozen || !tiles.hasChosen()) {
    const LevelView view = levelView(viewForBothEyes(views[0], fitted.eye_W, ratio), eye, options.clear_end_um);
    const std::uint64_t most = moving ? f.budget.moving_segments : f.budget.segments;
    changed |= tiles.choose(view, fitted.focus_W(), most, f.budget.enough_px, !whole, f.time_s);
  }
  if (whole)
    tiles.request(false, f.time_s);
  else
    tiles.requestIfDue(true, f.time_s);
}

void SceneView::Impl::putOverlays(const SceneFrame& f) {
  const double px_rad = pixelsPerRadian(viewOf(fitted, eye.aspect()).frustum, eye);
  const double scale = f.overlay_scale > 0 ? f.overlay_scale : std::max(1.0, eye.height / 800.0);
  const double um_px = fitted.focus_um / px_rad * scale;
  const auto put = [&](Overlay id, bool present, const auto& make) {
    if (present)
      renderer.put(id, make(), Layer::overlays);
    else
      renderer.remove(id);
  };
  put(kWorkspaceBoxes, f.workspace != nullptr, [&] { return workspaceBatch(*f.workspace, 1.6 * um_px); });
  const std::optional<Vector3d>& proxy_W = motion.proxy_W();
  const bool on_light = f.background.r + f.background.g + f.background.b > 3 * 128;
  const Rgba& proxy = on_light ? kProxyOnLightColour : kProxyColour;
  put(kProxyBall, proxy_W.has_value(), [&] { return proxyBatch(*proxy_W, 7 * um_px, proxy); });
  put(kCompanionBall, f.companion_W.has_value(),
      [&] { return proxyBatch(*f.companion_W, 7 * um_px, kCompanionColour); });
  put(kMarks, f.marks_W != nullptr, [&] { return ballsBatch(*f.marks_W, 3.5 * um_px, kMarkColour); });
  put(kStylusShaft, f.stylus.has_value(), [&] { return stylusBatch(*f.stylus, 90 * um_px); });
  const GlyphPalette& palette = f.stereo == StereoMode::anaglyph ? kForGlasses : f.palette;
  put(kForkGlyph, f.junction != nullptr, [&] { return glyphBatch(*f.junction, 120 * um_px, 6 * um_px, palette); });
}

// Of all that the picture depends on, except its detail: tiles, samples and shading.
Signature SceneView::Impl::signatureOf(const SceneFrame& f) const {
  Signature now;
  for (const EyeView& view : views) addView(now, view);
  for (const int x : {f.size.width, f.size.height, static_cast<int>(f.stereo)}) now.add(x);
  for (const int x : {f.background.r, f.background.g, f.background.b}) now.add(x);
  now.add(f.overlay_scale);
  now.add(f.flat ? 1 : 0);
  now.add(static_cast<double>(tiles.palettes()));
  if (f.workspace != nullptr) {
    now.add(f.workspace->centre_W());
    now.add(f.workspace->rotationMatrix());
    now.add(f.workspace->zoom_um());
  }
  if (motion.proxy_W()) now.add(*motion.proxy_W());
  if (f.companion_W) now.add(*f.companion_W);
  now.add(marks_version);
  if (f.stylus) {
    now.add(f.stylus->tip_W);
    for (const double part : f.stylus->rotation_WS.coeffs()) now.add(part);
  }
  if (f.junction != nullptr) {
    now.add(f.junction->p_W);
    now.add(f.palette.own);
    now.add(f.palette.other);
    for (const Branch& branch : f.junction->branches) {
      now.add(branch.own ? 1 : 0);
      now.add(branch.points_W.back());
    }
  }
  return now;
}

// A picture of the same view with other detail waits until all tiles are there, or for kRefine_s: each costs as much as
// the last one.
bool SceneView::Impl::isDue(const SceneFrame& f, const Signature& now) {
  const bool waits = counted.pending > 0;
  if (!has_picture) return counted.tiles > 0 || !waits || f.time_s - first_s >= kFirst_s;
  if (!(now == last_picture)) return true;
  // No tile is uploaded while a picture is under way: leave time for both.
  return can_refine && (!waits || f.time_s - last_picture_s >= std::max(kRefine_s, 3e-3 * figures.picture_ms));
}

bool SceneView::Impl::isQuick(const SceneFrame& f) const {
  if (moving || std::isinf(f.budget.part_ms)) return std::isinf(moving ? f.budget.moving_part_ms : f.budget.part_ms);
  const double more =
      static_cast<double>(counted.segments) / static_cast<double>(std::max<std::uint64_t>(rest_segments, 1));
  const double moved_ms = sample_ms * f.budget.samples * f.budget.samples;
  return std::max(moved_ms, rest_ms * std::max(more, 1.0)) < kAtOnce * f.budget.part_ms;
}

// Sets the size of the picture. Rows of two eyes in turn need the screen's own pixels.
void SceneView::Impl::stretchTo(const SceneFrame& f, int wanted) {
  stretch = f.stereo == StereoMode::row_interleaved ? 1 : std::min(wanted, SceneBudget::kMostStretch);
  options.size = {(f.size.width + stretch - 1) / stretch, (f.size.height + stretch - 1) / stretch};
  options.halo_px = RenderOptions{}.halo_px / stretch;
}

// Draws the picture in motion that has begun. What takes longer than a part is begun again, with one sample a pixel and
// the largest pixels: trying smaller ones would take longer. `begin`: of the picture that is drawn to its end.
void SceneView::Impl::drawInTime(const SceneFrame& f, Clock::time_point& begin) {
  if (renderer.advance(f.budget.moving_part_ms) >= 1) return;
  const Detail before = detail();
  options.samples = 1;
  options.shade_um = 0;
  stretchTo(f, SceneBudget::kMostStretch);
  if (!(detail() == before)) {
    begin = Clock::now();
    figures.drawn = renderer.begin(views, options);
  }
  renderer.advance(INFINITY);
}

// Begins the picture, or goes on with it.
void SceneView::Impl::advance(const SceneFrame& f, bool begins) {
  Clock::time_point begin = Clock::now();
  // As it stays if the driver refuses something: then the picture is not tried again.
  under_way = false;
  const bool had_picture = std::exchange(has_picture, true);
  if (begins) {
    drawn_ms = 0;
    figures.drawn = isQuick(f) ? renderer.draw(views, options) : renderer.begin(views, options);
  }
  if (begins && moving)
    drawInTime(f, begin);
  else
    under_way = renderer.advance(f.budget.part_ms) < 1;
  last_detail = detail();
  if (!under_way) renderer.finish();
  drawn_ms += since_ms(begin);
  if (under_way) {
    has_picture = had_picture;
    return;
  }
  figures.redrawn = true;
  figures.picture_ms = drawn_ms;
  figures.samples = options.samples;
  figures.stretch = stretch;
  last_picture_s = f.time_s;
  if (moving) {
    sample_ms = drawn_ms * stretch * stretch / (options.samples * options.samples);
    return;
  }
  sample_ms = 0;
  rest_ms = drawn_ms;
  rest_segments = counted.segments;
}

void SceneView::Impl::draw(const SceneFrame& f) {
  Signature now = signatureOf(f);
  first_s = std::min(first_s, f.time_s);
  figures.redrawn = false;
  if (renderer.isUnderWay() && now == last_picture && detail() == last_detail) {
    advance(f, false);
  } else {
    if (changed) {
      tiles.selectShown();
      tiles.evict(f.budget.card_bytes);
      tiles.count(counted);
      changed = false;
    }
    // What was abandoned is still to be drawn.
    can_refine |= std::exchange(under_way, false);
    can_refine |= tiles.takeChangeOfShown() || !(detail() == last_detail);
    if (isDue(f, now)) {
      putOverlays(f);
      figures.refined = has_picture && now == last_picture;
      // Before drawing: what the driver refuses is not tried again in each frame.
      last_picture = std::move(now);
      last_detail = detail();
      can_refine = false;
      advance(f, true);
    }
  }
  figures.drawing = under_way;
  if (figures.redrawn || !has_picture) return tiles.count(figures);
  figures.pending = counted.pending;
  figures.failed = counted.failed;
  figures.card_bytes = counted.card_bytes;
  figures.complete = counted.complete && !can_refine && !figures.drawing;
}

SceneFigures SceneView::draw(const SceneFrame& f) {
  Impl& s = *impl_;
  s.prepare(f, false);
  // A tile that arrives would abandon the picture under way.
  if (!s.renderer.isUnderWay())
    s.changed |= s.tiles.upload(f.budget, false, f.time_s, s.figures);
  else
    s.figures.uploads = 0;
  s.draw(f);
  return s.figures;
}

SceneFigures SceneView::drawWhole(const SceneFrame& f,
                                  const std::function<void(std::size_t done, std::size_t all)>& progress) {
  Impl& s = *impl_;
  s.prepare(f, true);
  const std::size_t all = s.tiles.wholeSize();
  for (;;) {
    const std::size_t done = s.tiles.wholeDone();
    if (progress) progress(done, all);
    if (done == all) break;
    s.tiles.waitForTiles(0.1);
    s.tiles.upload(f.budget, true, f.time_s, s.figures);
  }
  s.changed = true;
  s.has_picture = false;
  SceneFrame at_once = f;
  at_once.budget.part_ms = INFINITY;
  s.draw(at_once);
  return s.figures;
}

double SceneView::advanceWhole(const SceneFrame& f, double most_ms) {
  constexpr double kLoading = 0.5;  // the part of the progress that is loading
  Impl& s = *impl_;
  if (s.whole_drawing) {
    const double part = s.renderer.advance(most_ms);
    s.whole_drawing = part < 1;
    return kLoading + (1 - kLoading) * part;
  }
  if (!std::exchange(s.whole_begun, true)) s.prepare(f, true);
  s.tiles.upload(f.budget, false, f.time_s, s.figures);
  const std::size_t all = s.tiles.wholeSize(), done = s.tiles.wholeDone();
  if (done < all) return kLoading * static_cast<double>(done) / static_cast<double>(all);
  s.tiles.selectShown();
  s.putOverlays(f);
  s.figures.drawn = s.renderer.begin(s.views, s.options);
  s.tiles.count(s.figures);
  s.has_picture = s.whole_begun = false;
  s.whole_drawing = true;
  return kLoading;
}

}  // namespace filiform
