// filiform render: a picture of a scene, without a display.
#include "index/cell_graph.h"
#include "index/errors.h"
#include "index/nearest.h"
#include "index/text.h"
#include "index/tile_set.h"
#include "solver/graph_view.h"
#include "solver/workspace.h"
#include "tools/cli.h"
#include "tools/image.h"
#include "tools/progress.h"
#include "tools/scene.h"
#include "viewer/draw_list.h"
#include "viewer/glyph.h"
#include "viewer/overlay.h"
#include "viewer/renderer.h"

#include <algorithm>
#include <cmath>
#include <iostream>
#include <numbers>
#include <optional>
#include <set>

#include <CLI/CLI.hpp>
#include <nlohmann/json.hpp>

namespace filiform::tools {

namespace {

struct RenderArguments {
  std::string scene, out, camera, size = "1280x800", stereo = "mono", colour_by = "cell", proxy, at,
                                  palette = "red-green";
  double zoom_um = 300, widening = 1, separation = 1, error_px = 0.5;
  std::uint64_t segments = 2'000'000;
  int samples = 2;
  bool json = false;
};

std::vector<double> parseNumbers(const std::string& what, const std::string& text, std::size_t count) {
  std::vector<double> values;
  std::size_t begin = 0;
  while (begin <= text.size()) {
    const std::size_t end = std::min(text.find(',', begin), text.size());
    values.push_back(parseNumber(what, text.substr(begin, end - begin)));
    begin = end + 1;
  }
  if (values.size() != count)
    throw UsageError(what + " " + escaped(text) + ": give " + std::to_string(count) + " numbers with commas between");
  return values;
}

Vector3d parsePoint(const std::string& what, const std::string& text) {
  const std::vector<double> v = parseNumbers(what, text, 3);
  return {v[0], v[1], v[2]};
}

PictureSize parseSize(const std::string& text) {
  const std::size_t cross = text.find('x');
  if (cross == std::string::npos) throw UsageError("--size " + escaped(text) + ": give WIDTHxHEIGHT, such as 1280x800");
  const double width = parseNumber("--size", text.substr(0, cross));
  const double height = parseNumber("--size", text.substr(cross + 1));
  for (const double side : {width, height})
    if (side != std::floor(side) || side < 1 || side > Renderer::kMaxSize)
      throw UsageError("--size " + escaped(text) + ": each side is a whole number from 1 to " +
                       std::to_string(Renderer::kMaxSize));
  return {static_cast<int>(width), static_cast<int>(height)};
}

struct Bounds {
  Vector3d lo_W, hi_W;
};

Bounds boundsOf(const TileStore& store) {
  GridBox box;
  for (TileId tile = 0; tile < store.tile_count(); ++tile)
    if (!store.entry(tile).content.empty()) box.extend(store.entry(tile).content);
  if (box.empty()) throw InputError("there is nothing to draw: the scene has no segment");
  const Vector3d rim = Vector3d::Constant(kDrawnUnknownSoma_um);  // the box is that of the samples' middles
  return {store.grid().toWorld(box.lo) - rim, store.grid().toWorld(box.hi) + rim};
}

// Where the proxy stands, and the fork that it is next to.
struct Proxy {
  Vector3d p_W;
  std::optional<Junction> junction;
};

// What --proxy or --at names, moved to the nearest thread.
NearestResult placeNamed(const TileStore& store, const RenderArguments& a) {
  const Nearest nearest(store);
  if (!a.proxy.empty()) {
    const std::vector<NearestResult> found = nearest.find(parsePoint("--proxy", a.proxy));
    if (found.empty()) throw InputError("--proxy: the scene has no segment");
    return found.front();
  }
  const std::size_t colon = a.at.rfind(':');
  if (colon == std::string::npos) throw UsageError("--at " + escaped(a.at) + ": give CELL:SAMPLE");
  const std::uint32_t cell = findCellNamed(store, a.at.substr(0, colon));
  const double id = parseNumber("--at", a.at.substr(colon + 1));
  const CellGraph graph = readCell(store, cell, false);
  const auto sample = std::find_if(graph.sample_ids.begin(), graph.sample_ids.end(),
                                   [&](std::int64_t have) { return static_cast<double>(have) == id; });
  if (sample == graph.sample_ids.end())
    throw UsageError("--at " + escaped(a.at) + ": the cell has no sample of that id");
  const Vector3d p_W = graph.position_W(static_cast<std::uint32_t>(sample - graph.sample_ids.begin()));
  for (const NearestResult& result : nearest.find(p_W, {.k = SIZE_MAX, .max_distance_um = 0}))
    if (result.segment.cell == cell) return result;
  throw InputError("--at " + escaped(a.at) + ": the sample is on no segment");
}

Proxy findProxy(const TileStore& store, const RenderArguments& a) {
  const NearestResult place = placeNamed(store, a);
  std::vector<std::shared_ptr<const Tile>> tiles;
  TileTable table(store.tile_count());
  const GraphView graph(table, store.leaves(), store.grid());
  const auto load = [&](TileId tile) {
    tiles.push_back(store.load(tile));
    table.add(*tiles.back());
  };
  load(place.tile);
  const GraphView::SegmentRef on = graph.segment(place.tile, place.segment);
  const ProxyPlace proxy = graph.placeOn(*on.tile, on.segment, place.t, place.p_W);
  const double reach_um = a.zoom_um / 2;
  for (int round = 0;; ++round) {
    JunctionSearch search = findJunction(graph, proxy, Vector3d::Zero(), reach_um, a.zoom_um / 10);
    // A fork in a tile that is not there yet may be nearer.
    if (search.absent.empty() || round == 64) return {place.p_W, std::move(search.junction)};
    for (const TileId tile : search.absent) load(tile);
  }
}

Camera cameraOf(const RenderArguments& a, const Bounds& bounds, const std::optional<Proxy>& proxy,
                const std::optional<Workspace>& workspace, double aspect) {
  const std::string& name = a.camera;
  constexpr double kRight = std::numbers::pi / 2;
  const auto around = [&](double yaw, double pitch) {
    Camera camera = overview(bounds.lo_W, bounds.hi_W, yaw, pitch, aspect);
    if (!proxy) return camera;
    // Turned about the proxy instead, at the distance of the follower's view.
    Camera close = follow(*workspace, aspect);
    close = orbit(close, yaw, pitch);
    return close;
  };
  if (name.empty() || name == "follow") {
    if (workspace) return follow(*workspace, aspect);
    if (!name.empty()) throw UsageError("--camera follow: say where the proxy is, by --proxy or --at");
    return around(0, 0);
  }
  if (name == "front") return around(0, 0);
  if (name == "back") return around(2 * kRight, 0);
  if (name == "right") return around(kRight, 0);
  if (name == "left") return around(-kRight, 0);
  if (name == "top") return around(0, kRight);
  if (name == "bottom") return around(0, -kRight);
  if (const std::size_t colon = name.find(':'); colon != std::string::npos) {
    const Camera camera =
        lookAt(parsePoint("--camera", name.substr(0, colon)), parsePoint("--camera", name.substr(colon + 1)));
    return fitDepth(camera, bounds.lo_W, bounds.hi_W);
  }
  if (name.find(',') == std::string::npos)
    throw UsageError("--camera " + escaped(name) +
                     ": give front, back, left, right, top, bottom, follow, YAW,PITCH in degrees, or X,Y,Z:X,Y,Z");
  const std::vector<double> angles = parseNumbers("--camera", name, 2);
  return around(angles[0] * std::numbers::pi / 180, angles[1] * std::numbers::pi / 180);
}

struct Drawn {
  DrawList list;
  RenderFigures figures;
  std::uint64_t uploaded = 0, implausible = 0;
  std::string renderer;
};

// Loads what the list names and puts it on the card.
void putThreads(const TileStore& store, const Levels* levels, const RenderArguments& a, const Bounds& bounds,
                Renderer& renderer, Drawn& drawn) {
  RootTable roots;
  std::set<std::uint32_t> cells_known;
  BatchOptions options{
      .colour = colourBy(a.colour_by), .shallow_um = bounds.hi_W.y(), .deep_um = bounds.lo_W.y(), .roots = &roots};
  Progress progress({.title = "render", .noun = "tiles", .total = drawn.list.parts.size()});
  Renderer::BatchId id = 0;
  for (const LevelPart& part : drawn.list.parts) {
    throwIfInterrupted();
    const std::shared_ptr<const Tile> tile = part.level ? levels->load(part.tile) : store.load(part.tile);
    const TileAppearance appearance = part.level ? levels->loadAppearance(part.tile) : store.loadAppearance(part.tile);
    // Nodes of level tiles are no samples: their somata are not known.
    if (!part.level)
      for (std::uint32_t s = 0; s < tile->segment_count(); ++s)
        if (const std::uint32_t cell = tile->segmentId(s).cell; cells_known.insert(cell).second)
          addRoots(store, cell, roots);
    options.roots = part.level ? nullptr : &roots;
    const ThreadBatch batch = makeBatch(*tile, appearance, options);
    drawn.implausible += batch.implausible_radii;
    drawn.uploaded += batch.segments.size();
    renderer.put(++id, batch);
    progress.update(id);
  }
  progress.finish();
}

void putMarks(const Proxy& proxy, const Workspace& workspace, const Camera& camera, const RenderArguments& a,
              const PictureSize& eye, Renderer& renderer) {
  const double px_rad = pixelsPerRadian(viewOf(camera, eye.aspect()).frustum, eye);
  const double um_px = camera.focus_um / px_rad * std::max(1.0, eye.height / 800.0);
  constexpr Renderer::BatchId kMarks = Renderer::BatchId{1} << 40;
  renderer.put(kMarks, workspaceBatch(workspace, 1.6 * um_px), Layer::marks);
  renderer.put(kMarks + 1, proxyBatch(proxy.p_W, 7 * um_px), Layer::marks);
  if (!proxy.junction) return;
  const GlyphPalette palette = a.palette == "red-green" ? kRedGreen : kOrangeBlue;
  renderer.put(kMarks + 2, glyphBatch(*proxy.junction, 90 * um_px, 5 * um_px, palette), Layer::marks);
}

Drawn drawScene(const TileStore& store, const Levels* levels, const RenderArguments& a, Image& image) {
  Drawn drawn;
  const StereoMode stereo = stereoMode(a.stereo);
  const PictureSize size = parseSize(a.size), eye = eyeSize(stereo, size);
  const Bounds bounds = boundsOf(store);
  std::optional<Proxy> proxy;
  std::optional<Workspace> workspace;
  if (!a.proxy.empty() || !a.at.empty()) {
    workspace.emplace(WorkspaceOptions{.zoom_um = a.zoom_um});
    proxy = findProxy(store, a);
    workspace->place(proxy->p_W, workspace->centre_D());
  }
  Camera camera = cameraOf(a, bounds, proxy, workspace, eye.aspect());

  // Depths within which things are: the workspace's, or all.
  const Camera whole = fitDepth(camera, bounds.lo_W, bounds.hi_W);
  RenderOptions options{.size = size, .stereo = stereo, .samples = a.samples};
  double nearest_um = whole.near_um, farthest_um = whole.far_um;
  if (proxy) {
    const double half_um = a.zoom_um / 2;
    nearest_um = std::max(camera.near_um, camera.focus_um - half_um);
    farthest_um = camera.focus_um + half_um;
    options.fog_begin_um = camera.focus_um - half_um / 2;
    options.fog_end_um = camera.far_um;
    options.fog_most = 1;
    options.clear_end_um = camera.focus_um - 1.5 * half_um;
    options.clear_begin_um = nearest_um;
  } else {
    const Vector3d rim = Vector3d::Constant(kThickestSoma_um);
    camera = fitDepth(camera, bounds.lo_W - rim, bounds.hi_W + rim);
    options.fog_begin_um = nearest_um;
    options.fog_end_um = farthest_um;
    options.fog_most = 0.75;
  }
  const double width_tan = std::tan(camera.height_angle_rad / 2) * eye.aspect();
  const double ratio = stereo == StereoMode::mono ? 0
                                                  : separationRatio({.gain = a.separation}, camera.focus_um, nearest_um,
                                                                    farthest_um, width_tan);
  const auto views = stereoViews(camera, eye.aspect(), ratio, a.widening);

  const auto context = makeOffscreenContext();
  drawn.renderer = context->description();
  Renderer renderer(*context);
  // One list for both eyes, whose views differ by a hand's breadth: wide enough for both.
  EyeView both = views[0];
  both.eye_W = camera.eye_W;
  both.frustum.right = std::max(-both.frustum.left, both.frustum.right) * (1 + 2 * ratio);
  both.frustum.left = -both.frustum.right;
  drawn.list = chooseTiles(store, levels, levelView(both, eye), camera.focus_W(), a.segments, a.error_px);
  putThreads(store, levels, a, bounds, renderer, drawn);
  if (proxy) putMarks(*proxy, *workspace, camera, a, eye, renderer);
  drawn.figures = renderer.draw(views, options);
  Picture picture = renderer.read();
  image.width = picture.width;
  image.height = picture.height;
  image.rgb = std::move(picture.rgb);
  return drawn;
}

int runRender(const RenderArguments& a) {
  if (!a.proxy.empty() && !a.at.empty()) throw UsageError("--proxy and --at: give one of them");
  if (a.palette != "red-green" && a.palette != "orange-blue")
    throw UsageError("--palette " + escaped(a.palette) + ": choose red-green or orange-blue");
  parseSize(a.size);
  stereoMode(a.stereo);
  colourBy(a.colour_by);

  std::unique_ptr<TileStore> store;
  std::unique_ptr<Levels> levels;
  if (isFileScene(a.scene)) {
    store = buildScene(a.scene);
  } else {
    auto set = TileSet::open(a.scene);
    levels = Levels::open(*set);
    store = std::move(set);
  }
  Image image;
  const Drawn drawn = drawScene(*store, levels.get(), a, image);
  writePng(image, a.out);

  const DrawList& list = drawn.list;
  if (a.json) {
    const nlohmann::ordered_json json{{"width", image.width},
                                      {"height", image.height},
                                      {"segments", list.segments},
                                      {"tiles", list.parts.size()},
                                      {"error_px", list.error_px},
                                      {"left_out", list.left_out},
                                      {"tiles_left_out", list.tiles_left_out},
                                      {"lines", drawn.figures.lines},
                                      {"cones", drawn.figures.cones},
                                      {"implausible_radii", drawn.implausible},
                                      {"levels", levels != nullptr},
                                      {"renderer", drawn.renderer}};
    std::cout << json.dump(1, ' ', false, nlohmann::json::error_handler_t::replace) << '\n';
  } else {
    std::cout << escaped(a.out) << ": " << image.width << " x " << image.height << ", " << formatCount(list.segments)
              << " segments in " << formatCount(list.parts.size()) << " tiles, error at most "
              << formatNumber(std::ceil(list.error_px * 100) / 100) << " px; drawn by " << drawn.renderer << '\n';
    if (list.left_out > 0)
      std::cout << "  left out: " << formatCount(list.left_out) << " segments (--segments allows "
                << formatCount(a.segments) << ")\n";
    if (drawn.implausible > 0)
      std::cout << "  radii that are unknown or cannot be in um: " << formatCount(drawn.implausible)
                << ", drawn with a usual one\n";
  }
  return 0;
}

}  // namespace

void addRender(CLI::App& app, Chosen& chosen) {
  auto a = std::make_shared<RenderArguments>();
  CLI::App* command = app.add_subcommand("render", "A picture of a scene, without a display");
  command->footer(
      "Example:\n  filiform render column.fil -o overview.png\n"
      "  filiform render column.fil -o near.png --at CELL:245 --zoom 200 --stereo anaglyph\n"
      "  filiform render cell.swc -o cell.png --camera 30,20 --colour-by type");
  command->add_option("SCENE", a->scene, "tile set, or an .swc file or small .zip that is drawn directly")
      ->required()
      ->type_name("SET|FILE.swc");
  command->add_option("-o,--out", a->out, "the picture, PNG")->required()->type_name("FILE");
  command->add_option("--size", a->size, "in pixels")->capture_default_str()->type_name("WxH");
  command
      ->add_option(
          "--camera", a->camera,
          "front, back, left, right, top, bottom; YAW,PITCH in degrees from the front; X,Y,Z:X,Y,Z from a point "
          "to another; follow: the workspace (the default with --proxy and --at)")
      ->type_name("VIEW");
  command->add_option("--proxy", a->proxy, "where the proxy is: on the thread nearest to this point, um")
      ->type_name("X,Y,Z");
  command->add_option("--at", a->at, "or at this sample of a cell")->type_name("CELL:SAMPLE");
  command->add_option("--zoom", a->zoom_um, "um of world across the workspace about the proxy")
      ->capture_default_str()
      ->type_name("UM")
      ->check(CLI::Range(Workspace::kMinZoom_um, Workspace::kMaxZoom_um));
  command->add_option("--stereo", a->stereo, "mono, anaglyph, side-by-side, top-bottom or row-interleaved")
      ->capture_default_str();
  command->add_option("--separation", a->separation, "of the eyes, times what is comfortable")
      ->capture_default_str()
      ->check(CLI::Range(0.0, 2.0));
  command->add_option("--widening", a->widening, "of the projection angle's tangent: wider is easier to fuse")
      ->capture_default_str()
      ->check(CLI::Range(0.5, 3.0));
  command->add_option("--colour-by", a->colour_by, "cell, type, depth, radius or tile")->capture_default_str();
  command->add_option("--palette", a->palette, "of the branches at a fork: red-green or orange-blue")
      ->capture_default_str();
  command->add_option("--segments", a->segments, "at most so many are drawn")->capture_default_str();
  command->add_option("--error", a->error_px, "levels of detail may be wrong by so many pixels")
      ->capture_default_str()
      ->type_name("PX")
      ->check(CLI::NonNegativeNumber);
  command->add_option("--samples", a->samples, "across a pixel")->capture_default_str()->check(CLI::Range(1, 4));
  command->add_flag("--json", a->json, "what was drawn, as one JSON object");
  command->callback([a, &chosen] { chosen = [a] { return runRender(*a); }; });
}

}  // namespace filiform::tools
