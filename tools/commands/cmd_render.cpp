// filiform render: draws a picture of a scene without a display.
#include "index/attributes/cell_attributes.h"
#include "index/attributes/cell_filter.h"
#include "index/count_text.h"
#include "index/errors.h"
#include "index/set/tile_set.h"
#include "index/text.h"
#include "solver/travel/places/cell_place_text.h"
#include "solver/travel/places/place_finder.h"
#include "solver/travel/run/recorded_options.h"
#include "solver/travel/run/run.h"
#include "solver/travel/session/session.h"
#include "solver/workspace/navigation_link.h"
#include "solver/workspace/workspace.h"
#include "tools/commands/commands.h"
#include "tools/commands/figure/figure_arguments.h"
#include "tools/commands/figure/only_cells.h"
#include "tools/commands/figure/picture_writer.h"
#include "tools/commands/shared/cell_conditions.h"
#include "tools/commands/shared/colour_table.h"
#include "tools/commands/shared/colouring.h"
#include "tools/commands/shared/remote_arguments.h"
#include "tools/commands/shared/scene.h"
#include "tools/commands/shared/view_file.h"
#include "tools/pictures/camera_text.h"
#include "tools/pictures/film.h"
#include "tools/program/cli.h"
#include "tools/program/interruption.h"
#include "tools/program/output_check.h"
#include "tools/program/progress.h"
#include "tools/program/progress_option.h"
#include "tools/words/cell_name.h"
#include "tools/words/numbers.h"
#include "viewer/gl/scene_view.h"
#include "viewer/scene/view_cells.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <filesystem>
#include <functional>
#include <iostream>
#include <limits>
#include <memory>
#include <optional>

#include <CLI/CLI.hpp>
#include <nlohmann/json.hpp>

namespace filiform::tools {

namespace {

struct RenderArguments {
  std::shared_ptr<const RemoteArguments> remote;
  std::string scene, out, camera, size = "1280x800", stereo = "mono", colour_by = "cell", proxy, at,
                                  palette = "red-green", theme = "dark", colour_table, view, path, cell, gpu,
                                  route = "longest", method = "climb";
  double zoom_um = 300, widening = 1, separation = 1, error_px = Levels::kEnough_px;
  std::uint64_t segments = 2'000'000;
  double pictures_s = 30;
  int samples = 2;
  std::optional<ViewState> shown;                          // that --view names
  std::vector<std::string> where, only, highlight, given;  // given: the options of the command line, for --path
  FigureArguments figure;
  bool orthographic = false, all = false, json = false, no_legend = false;
};

// The colours of --colour-by with a measure or an attribute, and of --where; nullptr without them. `set`: the store, if
// it is a set. `only`: the cells of --only, or none.
std::shared_ptr<const CellColours> cellColoursOf(const TileStore& store, const TileSet* set, const Colouring& colouring,
                                                 const RenderArguments& a, const std::vector<std::uint32_t>& only) {
  if (!a.colour_table.empty()) return readColourTable(store, a.colour_table, a.figure.on(themeOf(a.theme)));
  if (colouring.kind && a.where.empty()) return nullptr;
  CellSelection selection{.theme = a.figure.on(themeOf(a.theme))};
  std::unique_ptr<CellAttributes> attributes;
  if (set != nullptr) {
    attributes = std::make_unique<CellAttributes>(*set);
    const CellConditions conditions(a.where);
    if (!conditions.empty()) selection.only = cellsMeeting(conditions, *set, *attributes, 0);
    if (selection.only && selection.only->empty()) throw UsageError("--where: no cell meets the conditions");
    if (!only.empty() && selection.only) {
      std::erase_if(*selection.only, [&](std::uint32_t c) { return !std::binary_search(only.begin(), only.end(), c); });
      if (selection.only->empty()) throw UsageError("--where: no cell of --only meets the conditions");
    } else if (!only.empty()) {
      selection.only = only;
    }
  }
  if (colouring.feature == nullptr) return coloursByAttribute(*set, *attributes, colouring.attribute, selection);
  std::vector<std::uint32_t> cells = selection.only.value_or(std::vector<std::uint32_t>());
  for (std::uint32_t cell = 0; !selection.only && cell < store.cell_count(); ++cell)
    if (!store.cell(cell).removed) cells.push_back(cell);
  CellValues values{a.colour_by, std::string(colouring.feature->unit),
                    std::vector<double>(store.cell_count(), std::numeric_limits<double>::quiet_NaN())};
  const std::vector<double> measured = valuesOf(store, cells, {colouring.feature}, 0).at(0);
  for (std::size_t i = 0; i < cells.size(); ++i) values.of_cell[cells[i]] = measured[i];
  return coloursByNumbers(store, values, selection);
}

nlohmann::ordered_json legendJson(const CellColours& colours) {
  nlohmann::ordered_json list = nlohmann::ordered_json::array();
  for (const CellColours::Entry& entry : colours.legend) {
    std::array<char, 8> hex{};
    std::snprintf(hex.data(), hex.size(), "#%02x%02x%02x", entry.colour.r, entry.colour.g, entry.colour.b);
    list.push_back({{"value", entry.value}, {"colour", hex.data()}, {"cells", entry.cells}});
  }
  return list;
}

// The position of the proxy, and the fork nearest to it.
struct Proxy {
  Vector3d p_W;
  std::optional<Junction> junction;
};

// The place given by --proxy or --at, on the nearest neurite.
ProxyPlace placeNamed(const TileStore& store, const PlaceFinder& finder, const RenderArguments& a) {
  if (!a.proxy.empty()) {
    const auto found = finder.nearest(parsePoint("--proxy", a.proxy));
    if (!found) throw InputError("--proxy: the scene has no segment");
    return found->place;
  }
  const CellPlaceText text = parseCellPlace("--at", a.at);
  const std::uint32_t cell = findCellNamed(store, text.cell, "--at");
  const std::shared_ptr<const CellWalk> walk = finder.walk(cell);
  return finder.at(*walk, cell, placesOf(walk->paths(), text).front());
}

// The fork near a place that is drawn beside the proxy.
std::optional<Junction> forkNear(const PlaceFinder& finder, const ProxyPlace& place, const Vector3d& heading_W,
                                 double zoom_um) {
  return finder.junction(place, heading_W, zoom_um / 2, zoom_um / 10);
}

Proxy findProxy(const TileStore& store, const RenderArguments& a) {
  const PlaceFinder finder(store);
  const ProxyPlace place = placeNamed(store, finder, a);
  return {place.p_W, forkNear(finder, place, Vector3d::Zero(), a.zoom_um)};
}

Camera cameraOf(const RenderArguments& a, const SceneView& scene, const std::optional<Proxy>& proxy,
                const std::optional<Workspace>& workspace, double aspect) {
  const CameraText text = parseCamera("--camera", a.camera);
  if (text.kind == CameraText::Kind::places)
    return fitDepth(lookAt(text.eye_W, text.target_W), scene.lo_W(), scene.hi_W());
  if (text.kind == CameraText::Kind::follow && !workspace)
    throw UsageError("--camera follow: give the place of the proxy with --proxy or --at");
  if (workspace && (text.kind == CameraText::Kind::follow || a.camera.empty()))
    return workspaceCamera(*workspace, aspect);
  // Turn about the proxy, at the distance of the default view.
  if (proxy) return orbit(workspaceCamera(*workspace, aspect), text.yaw_rad, text.pitch_rad);
  return a.all ? overview(scene.lo_W(), scene.hi_W(), text.yaw_rad, text.pitch_rad, aspect)
               : overview(scene.usual_lo_W(), scene.usual_hi_W(), text.yaw_rad, text.pitch_rad, aspect);
}

SceneFrame frameOf(const TileStore& store, const RenderArguments& a,
                   const std::shared_ptr<const CellColours>& colours) {
  SceneFrame frame;
  frame.cell_colours = colours;
  frame.size = a.figure.size(a.size, Renderer::kMaxSize);
  frame.stereo = stereoMode(a.stereo);
  frame.palette = a.palette == "red-green" ? kRedGreen : kOrangeBlue;
  frame.colour = parseColouring(a.colour_by).kind.value_or(ColourBy::cell);
  frame.orthographic = a.orthographic;
  frame.background = a.figure.ground(themeOf(a.theme));
  frame.flat = !a.figure.background.empty();
  frame.eyes = {.gain = a.separation, .widening = a.widening};
  frame.budget.segments = a.segments;
  frame.budget.samples = a.samples;
  frame.budget.enough_px = a.error_px;
  for (const std::string& name : a.highlight) frame.cells.push_back(findCellNamed(store, name, "--highlight"));
  std::sort(frame.cells.begin(), frame.cells.end());
  return frame;
}

SceneFigures drawPicture(const TileStore& store, const RenderArguments& a,
                         const std::shared_ptr<const CellColours>& colours, SceneView& scene, Renderer& renderer) {
  SceneFrame frame = frameOf(store, a, colours);
  std::optional<Proxy> proxy;
  std::optional<Workspace> workspace;
  if (!a.proxy.empty() || !a.at.empty()) {
    workspace.emplace(WorkspaceOptions{.zoom_um = a.zoom_um});
    proxy = findProxy(store, a);
    workspace->place(proxy->p_W, workspace->centre_D());
    frame.workspace = &*workspace;
    frame.proxy_W = proxy->p_W;
    frame.junction = proxy->junction ? &*proxy->junction : nullptr;
  }
  if (a.shown) {
    ViewCells cells = viewCellsOf(*a.shown, store);
    if (!cells.note.empty()) std::cerr << "filiform: note: " << cells.note << '\n';
    frame.cells = std::move(cells.highlighted);
    frame.states = std::make_shared<const CellStates>(std::move(cells.states));
    frame.hidden_types = a.shown->hidden_types;
    if (a.shown->place) {
      const PlaceFinder finder(store);
      proxy.emplace();
      proxy->p_W = a.shown->place->p_W;
      if (const auto found = finder.nearest(proxy->p_W); found && !a.shown->overview)
        proxy->junction = forkNear(finder, found->place, a.shown->place->heading_W, a.shown->zoom_um);
      frame.proxy_W = proxy->p_W;
      frame.junction = proxy->junction ? &*proxy->junction : nullptr;
    }
    if (!a.shown->overview) {
      workspace.emplace(WorkspaceOptions{.zoom_um = a.shown->zoom_um});
      workspace->lay(a.shown->centre_W, a.shown->rotation_WD, a.shown->zoom_um);
      frame.workspace = &*workspace;
    }
  }
  if (a.shown && a.shown->camera)
    frame.camera = *a.shown->camera;
  else
    frame.camera = cameraOf(a, scene, proxy, workspace, eyeSize(frame.stereo, frame.size).aspect());
  return writePicture(frame, {a.out, a.figure, themeOf(a.theme), !a.no_legend}, store, scene, renderer);
}

using ShowTick = std::function<void(const NavigationSnapshot&)>;

// Replays a recording of `navigate`. The note tells which options were taken from it.
void replayRunTo(const ShowTick& show, const TileStore& store, const RenderArguments& a) {
  RunOptions options;
  options.device = "replay:" + a.path;
  options.route = routeChoiceOf(a.route);
  options.method = solverMethod(a.method);
  options.zoom_um = a.zoom_um;
  options.given = a.given;
  options.in_memory = isFileScene(a.scene);
  if (!a.cell.empty()) options.cell = findCellNamed(store, a.cell);
  options.on_snapshot = show;
  const RunSummary summary = run(store, options);
  for (const std::string& note : summary.notes) std::cerr << "filiform: note: " << note << '\n';
}

// Replays a recording of `view` or `serve`, whose view and jumps lie beside it.
void replaySessionTo(const ShowTick& show, const TileStore& store, const RenderArguments& a) {
  for (const char* const option : {"--cell", "--route", "--method", "--zoom"})
    if (std::find(a.given.begin(), a.given.end(), option) != a.given.end())
      throw UsageError(std::string(option) + ": leave it out; " + escaped(a.path) +
                       " was recorded by view or serve, and shows the travel as it was");
  Session session(store, {.device = "replay:" + a.path, .in_memory = isFileScene(a.scene)});
  for (;;) {
    session.advance(1);
    if (session.replayEnded()) break;
    if (const NavigationSnapshot& now = session.update(); now.tick > 0) show(now);
  }
  if (const std::string fault = session.fault(); !fault.empty()) throw InputError(escaped(a.path) + ": " + fault);
}

// Draws a film of a recorded run, as the user saw it.
SceneFigures drawFilm(const TileStore& store, const RenderArguments& a,
                      const std::shared_ptr<const CellColours>& colours, SceneView& scene, Renderer& renderer,
                      std::string& out, std::uint64_t& pictures) {
  SceneFrame frame = frameOf(store, a, colours);
  const double aspect = eyeSize(frame.stereo, frame.size).aspect();
  Film film(a.out, frame.size.width, frame.size.height, a.pictures_s);
  if (!film.note().empty()) std::cerr << "filiform: note: " << film.note() << '\n';
  const PlaceFinder finder(store);
  Workspace workspace(WorkspaceOptions{});
  SceneFigures figures;
  Vector3d last_W = Vector3d::Zero();
  double first_s = 0;
  Progress progress({.title = "render", .noun = "pictures"});
  const auto show = [&](const NavigationSnapshot& seen) {
    throwIfInterrupted();
    if (seen.tick == 1) first_s = seen.time_s;
    const double time_s = seen.time_s - first_s;
    if (time_s < static_cast<double>(film.pictures()) / a.pictures_s) return;
    workspace.lay(seen.centre_W, seen.rotation_WD, seen.zoom_um);
    const Vector3d heading_W = film.pictures() > 0 ? Vector3d(seen.p_W - last_W) : Vector3d(Vector3d::Zero());
    const std::optional<Junction> junction = forkNear(finder, seen.place, heading_W, seen.zoom_um);
    last_W = seen.p_W;
    frame.workspace = &workspace;
    frame.proxy_W = seen.p_W;
    frame.junction = junction ? &*junction : nullptr;
    frame.camera = workspaceCamera(workspace, aspect);
    frame.time_s = time_s;
    figures = scene.drawWhole(frame);
    const Picture picture = renderer.read();
    // One picture for each moment, even where the recording's ticks are farther apart.
    while (static_cast<double>(film.pictures()) / a.pictures_s <= time_s) film.add(picture);
    progress.update(film.pictures());
  };
  if (isSessionRecording(a.path))
    replaySessionTo(show, store, a);
  else
    replayRunTo(show, store, a);
  if (film.pictures() == 0) throw InputError(escaped(a.path) + ": holds no tick, so there is no picture to draw");
  film.finish();
  progress.finish();
  out = film.out();
  pictures = film.pictures();
  return figures;
}

// Only a regular file needs the right ending: a device or a pipe may have any name.
void checkPictureName(const std::string& out) {
  const std::string ending = std::filesystem::path(out).extension().string();
  if (ending.empty() || endsWithNoCase(out, ".png") || vectorFormatOf(out) || !isFileOutput(out)) return;
  throw UsageError(
      "--output " + inShort(out) +
      ": pictures are FILE.png, FILE.svg or FILE.pdf, or PNG to - for standard output; with --path a film: "
      "FILE.mp4, .mkv, .webm, .mov or FILE-%05d.png");
}

std::string pixelsText(const SceneFigures& figures, const GraphicsContext& context) {
  return (std::isfinite(figures.error_px)
              ? "error at most " + formatNumber(std::ceil(figures.error_px * 100) / 100) + " px"
              : std::string("error not limited, because the eye lies in a simplified tile")) +
         "; drawn by " + context.description() + '\n';
}

// What goes together in a figure.
void checkFigure(const RenderArguments& a) {
  a.figure.check(Renderer::kMaxSize);
  const bool is_mono = stereoMode(a.stereo) == StereoMode::mono;
  if (!is_mono && (vectorFormatOf(a.out) || a.figure.hasMarks()))
    throw UsageError("--stereo " + inShort(a.stereo) + ": SVG, PDF and marks such as --scale-bar need mono");
  if (vectorFormatOf(a.out) && !(a.highlight.empty() && a.view.empty()))
    throw UsageError("--highlight and --view: SVG and PDF draw all cells alike; use --only, or write PNG");
  if (!a.path.empty() && (a.figure.hasMarks() || a.figure.isClear() || !a.only.empty()))
    throw UsageError(
        "--path: a film has all cells, a ground and no marks; leave out --only, --background none, --title, "
        "--scale-bar, --orientation and --legend");
  const Colouring colouring = parseColouring(a.colour_by);
  if (a.figure.legend && colouring.kind && (colouring.kind != ColourBy::type || !a.where.empty()))
    throw UsageError(
        "--legend: these colours have none; colour by type without --where, by an attribute or by a measure");
}

int runRender(RenderArguments a) {
  if (!a.view.empty()) {
    for (const char* const option : {"--proxy", "--at", "--camera", "--path", "--zoom", "--orthographic", "--only"})
      if (std::find(a.given.begin(), a.given.end(), option) != a.given.end())
        throw UsageError(std::string(option) + ": leave it out; --view says what is shown from where");
    a.shown = readViewFile(a.view);
    const auto has = [&a](const char* option) {
      return std::find(a.given.begin(), a.given.end(), option) != a.given.end();
    };
    if (!has("--size") && !has("--size-mm"))
      a.size = std::to_string(a.shown->size.width) + "x" + std::to_string(a.shown->size.height);
    if (!has("--colour-by") && !has("--colour-table")) a.colour_by = a.shown->colour_by;
    if (!has("--theme")) a.theme = toString(a.shown->theme);
  }
  if (!a.proxy.empty() && !a.at.empty()) throw UsageError("--proxy and --at: give one of them");
  if (a.palette != "red-green" && a.palette != "orange-blue")
    throw UsageError("--palette " + inShort(a.palette) + ": choose red-green or orange-blue");
  if (a.path.empty() && isFilmName(a.out))
    throw UsageError(inShort(a.out) + ": a film needs --path FILE, a recording of navigate --record");
  if (!a.path.empty() && !isFilmName(a.out))
    throw UsageError(inShort(a.out) + ": with --path give FILE.mp4, .mkv, .webm, .mov or FILE-%05d.png");
  if (!a.path.empty() && (!a.proxy.empty() || !a.at.empty() || !a.camera.empty()))
    throw UsageError("--path uses the recorded hand: leave out --proxy, --at and --camera");
  if (a.path.empty()) checkPictureName(a.out);
  parseSize("--size", a.size, Renderer::kMaxSize);
  checkFigure(a);
  const Colouring colouring = parseColouring(a.colour_by);
  if (isFileScene(a.scene)) {
    checkColouring(colouring, a.colour_by, nullptr);
    if (!a.where.empty()) throw UsageError("--where: the scene has no attributes of cells; only tile sets have");
    if (!a.only.empty()) throw UsageError("--only: the scene is a file; ingest it, and give the set");
  }
  std::vector<NamedPath> outputs;
  if (a.path.empty() || !isSequenceName(a.out)) outputs.push_back({"--output", a.out});
  for (const std::string& file : filesOfSequence(a.out)) outputs.push_back({"--output", file});
  if (a.json) outputs.push_back({"--json", "-"});
  checkOutputs({{"SCENE", a.scene}, {"--path", a.path}}, outputs);
  std::ostream& people = isStandardOutput(a.out) ? std::cerr : std::cout;

  std::unique_ptr<TileStore> store;
  std::unique_ptr<Levels> levels;
  std::shared_ptr<const CellColours> colours;
  if (isFileScene(a.scene)) {
    store = buildScene(a.scene);
    colours = cellColoursOf(*store, nullptr, colouring, a, {});
  } else {
    auto set = TileSet::open(a.scene, a.remote->options());
    checkColouring(colouring, a.colour_by, set.get());
    const std::vector<std::uint32_t> only = onlyCells(*set, a.only);
    colours = cellColoursOf(*set, set.get(), colouring, a, only);
    if (only.empty()) {
      levels = Levels::open(*set);
      store = std::move(set);
    } else {
      SomeCells some = sceneOfCells(*set, only);
      if (colours != nullptr || colouring.kind == ColourBy::cell) colours = coloursOfCells(colours.get(), some.cells);
      store = std::move(some.scene);
    }
  }
  const auto context = makeOffscreenContext(a.gpu);
  Renderer renderer(*context);
  SceneView scene(*store, levels.get(), renderer);
  std::string out = a.out;
  std::uint64_t pictures = 1;
  const SceneFigures figures = a.path.empty() ? drawPicture(*store, a, colours, scene, renderer)
                                              : drawFilm(*store, a, colours, scene, renderer, out, pictures);
  const PictureSize size = a.figure.size(a.size, Renderer::kMaxSize);
  if (a.json) {
    const nlohmann::ordered_json json{{"width", size.width},
                                      {"height", size.height},
                                      {"segments", figures.segments},
                                      {"tiles", figures.tiles},
                                      {"error_px", figures.error_px},
                                      {"left_out", figures.left_out},
                                      {"hidden", figures.hidden},
                                      {"limited", figures.limited},
                                      {"tiles_left_out", figures.tiles_left_out},
                                      {"lines", figures.drawn.lines},
                                      {"cones", figures.drawn.cones},
                                      {"far_segments", scene.far_segments()},
                                      {"implausible_radii", figures.implausible_radii},
                                      {"levels", levels != nullptr},
                                      {"renderer", context->description()},
                                      {"out", out},
                                      {"pictures", pictures},
                                      {"legend", colours ? legendJson(*colours) : nlohmann::ordered_json::array()}};
    std::cout << json.dump(1, ' ', true, nlohmann::json::error_handler_t::replace) << '\n';
    return 0;
  }
  people << escaped(out) << ": ";
  if (!a.path.empty()) people << counted(pictures, "picture") << " of ";
  people << size.width << " x " << size.height << ", " << counted(figures.segments, "segment") << " in "
         << counted(figures.tiles, "tile") << ", "
         << (vectorFormatOf(a.out) && figures.drawn.batches == 0 ? std::string("drawn as lines\n")
                                                                 : pixelsText(figures, *context));
  if (colours)
    for (const CellColours::Entry& entry : colours->legend)
      people << "  " << escaped(colours->attribute, 60) << ' ' << escaped(entry.value, 60)
             << (colours->unit.empty() || entry.value == kWithoutValueText ? "" : " " + colours->unit) << ": "
             << counted(entry.cells, "cell") << "\n";
  if (figures.limited)
    people << "  coarser than --error " << formatNumber(a.error_px) << " px, because --segments allows "
           << counted(a.segments, "segment") << "; allow more for a finer picture\n";
  if (figures.hidden > 0)
    people << "  not drawn: " << counted(figures.hidden, "segment")
           << " whose pixels others cover; --error 0 and more --segments draw them\n";
  if (figures.left_out > 0)
    people << "  left out: " << counted(figures.left_out, "segment") << ", because --segments allows "
           << formatCount(a.segments) << (levels || !a.only.empty() ? "" : " and the scene has no levels of detail")
           << "; allow more"
           << (levels || isFileScene(a.scene) || !a.only.empty()
                   ? ""
                   : ", or ingest without --no-levels; after --add, filiform compact")
           << "\n";
  const bool is_overview = a.path.empty() && a.proxy.empty() && a.at.empty() && a.camera.find(':') == std::string::npos;
  if (is_overview && !a.all && scene.far_segments() > 0)
    people << "  not in the picture: " << counted(scene.far_segments(), "segment")
           << " far from all others; --all frames them too\n";
  if (figures.implausible_radii > 0)
    people << "  radii that are unknown or impossible in um: " << formatCount(figures.implausible_radii)
           << ", drawn with a usual radius\n";
  return 0;
}

}  // namespace

void addRender(CLI::App& app, Chosen& chosen) {
  auto a = std::make_shared<RenderArguments>();
  CLI::App* command = app.add_subcommand("render", "Draw a picture of a scene without a display");
  command->footer(
      "Example:\n  filiform render column.fil -o overview.png\n"
      "  filiform render column.fil -o near.png --at CELL:245 --zoom 200 --stereo anaglyph\n"
      "  filiform render column.fil -o travel.mp4 --path travel.rec --fps 30\n"
      "  filiform render cell.swc -o cell.png --camera 30,20 --colour-by type\n"
      "  filiform render circuit.fil -o circuit.png --colour-by layer\n"
      "  filiform render column.fil -o lengths.png --colour-by measure:length\n"
      "  filiform render column.fil -o figure.pdf --only CELL --background white --scale-bar --size-mm 85x60");
  command->add_option("SCENE", a->scene, "tile set or its address, .swc file or small .zip (read into memory)")
      ->required()
      ->type_name("SET|FILE.swc");
  command
      ->add_option("-o,--output,--out", a->out,
                   "write the picture, .png, .svg or .pdf; with --path a film; - for standard output, PNG")
      ->required()
      ->type_name("FILE");
  command->add_option("--size", a->size, "size of the picture, pixels")->capture_default_str()->type_name("WxH");
  command
      ->add_option(
          "--camera", a->camera,
          "view from front, back, left, right, top, bottom; YAW,PITCH in degrees from the front; X,Y,Z:X,Y,Z from a "
          "point to another; follow: the workspace (the default with --proxy and --at)")
      ->type_name("VIEW");
  command->add_option("--proxy", a->proxy, "put the proxy on the neurite nearest to this point, um")
      ->type_name("X,Y,Z");
  command
      ->add_option("--at", a->at, "put the proxy at CELL:soma, CELL:ID or another place on a cell, as in filiform path")
      ->type_name("PLACE");
  command->add_option("--zoom", a->zoom_um, "show this much tissue, um, across the workspace about the proxy")
      ->capture_default_str()
      ->type_name("UM")
      ->check(CLI::Range(Workspace::kMinZoom_um, Workspace::kMaxZoom_um));
  command
      ->add_option("--stereo", a->stereo,
                   "draw mono, anaglyph, side-by-side, top-bottom, row-interleaved or quad-buffer")
      ->capture_default_str();
  command->add_option("--separation", a->separation, "distance of the eyes, as a multiple of the comfortable one")
      ->capture_default_str()
      ->check(CLI::Range(0.0, 2.0));
  command->add_option("--widening", a->widening, "factor of the projection angle's tangent: wider is easier to fuse")
      ->capture_default_str()
      ->check(CLI::Range(0.5, 3.0));
  command->add_option("--colour-by", a->colour_by, kColouringHelp)->capture_default_str()->type_name("NAME");
  command
      ->add_option(
          "--where", a->where,
          "fade cells whose attribute does not meet NAME=VALUE, as in filiform cells; repeatable: all must hold")
      ->type_name("CONDITION")
      ->allow_extra_args(false);
  command
      ->add_option(
          "--only", a->only,
          "draw only this cell; or the cells whose attribute meets a condition as in --where; or those named in a "
          "file, a line each; repeatable: all of them together")
      ->type_name("NAME|CONDITION|@FILE")
      ->allow_extra_args(false);
  command
      ->add_option("--colour-table", a->colour_table,
                   "colour the cells as this file says: a name, a tab and #rrggbb a line; other cells are grey")
      ->type_name("FILE.tsv")
      ->excludes(command->get_option("--colour-by"))
      ->excludes(command->get_option("--where"));
  command
      ->add_option("--view", a->view, "draw the scene of this view, which V in the window of filiform view has saved")
      ->type_name("FILE.json");
  command->add_flag("--no-legend", a->no_legend, "leave out the legend of an attribute's colours");
  command->add_option("--palette", a->palette, "colours of the branches at a fork: red-green or orange-blue")
      ->capture_default_str();
  command->add_option("--theme", a->theme, "draw on a light or dark ground")
      ->capture_default_str()
      ->type_name("light|dark");
  addFigureArguments(*command, a->figure);
  command->add_option("--highlight", a->highlight, "emphasise this cell; the other cells fade; repeatable")
      ->type_name("CELL")
      ->allow_extra_args(false);
  command->add_flag("--orthographic", a->orthographic, "project in parallel: near objects look no larger");
  CLI::Option* path =
      command
          ->add_option(
              "--path", a->path,
              "draw a film of this recording of navigate, view or serve, to FILE.mp4 (needs ffmpeg) or FILE-%05d.png")
          ->type_name("FILE.rec");
  command->add_option("--fps", a->pictures_s, "pictures a second in a film")
      ->capture_default_str()
      ->needs(path)
      ->check(CLI::Range(0.1, 1000.0));
  command->add_option("--route", a->route, "another route than that of the recording")
      ->needs(path)
      ->capture_default_str();
  command->add_option("--cell", a->cell, "another cell than that of the recording")->needs(path);
  command->add_option("--method", a->method, "another method than that of the recording")
      ->needs(path)
      ->capture_default_str();
  command->add_option("--segments", a->segments, "draw at most N segments")->capture_default_str();
  command->add_option("--error", a->error_px, "allow levels of detail to be wrong by N pixels")
      ->capture_default_str()
      ->type_name("PX")
      ->check(CLI::NonNegativeNumber);
  command->add_option("--samples", a->samples, "samples across a pixel, against jagged edges")
      ->capture_default_str()
      ->check(CLI::Range(1, 4));
  command
      ->add_option("--gpu", a->gpu,
                   "draw with graphics card N, from 0, or with software; default: a card if there is one")
      ->type_name("N|software");
  command->add_flag("--all", a->all, "frame the whole scene, also the few segments that lie far from all others");
  command->add_flag("--json", a->json, "write what was drawn as one JSON object");
  a->remote = addRemoteArguments(*command);
  addProgressOption(*command);
  command->callback([a, command, &chosen] {
    a->given = givenOptions(*command);
    chosen = [a] { return runRender(*a); };
  });
}

}  // namespace filiform::tools
