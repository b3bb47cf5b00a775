// filiform view: travel through a scene in a window.
#include "device/check/found_devices.h"
#include "device/factory/device_factory.h"
#include "index/errors.h"
#include "index/ingest/memory_tiles.h"
#include "index/input/input.h"
#include "index/set/tile_set.h"
#include "index/text.h"
#include "solver/force/force_hold.h"
#include "solver/workspace/button_map.h"
#include "tools/commands/commands.h"
#include "tools/commands/figure/only_cells.h"
#include "tools/commands/shared/colour_table.h"
#include "tools/commands/shared/colouring.h"
#include "tools/commands/shared/follow.h"
#include "tools/commands/shared/remote_arguments.h"
#include "tools/commands/shared/scene.h"
#include "tools/commands/shared/view_file.h"
#include "tools/commands/shared/web_page.h"
#include "tools/pictures/png.h"
#include "tools/program/cli.h"
#include "tools/program/ending_watch.h"
#include "tools/program/interruption.h"
#include "tools/program/output_check.h"
#include "tools/words/cell_name.h"
#include "tools/words/numbers.h"
#include "viewer/window/application.h"
#include "viewer/window/settings/bindings.h"

#include <algorithm>
#include <atomic>
#include <cstdlib>
#include <filesystem>
#include <iostream>
#include <utility>

#include <CLI/CLI.hpp>

namespace filiform::tools {

namespace {

struct ViewArguments {
  std::shared_ptr<const RemoteArguments> remote;
  std::vector<std::string> scene, given;  // given: the options of the command line
  std::string device = "mouse", method = "climb", budget, record, state, pictures = ".", size, follow;
  double zoom_um = 300, leap = 1;
  std::optional<double> seconds, stiffness_N_m;
  std::uint64_t segments = 0;
  std::string theme, colour_by, colour_table, buttons, view;
  std::vector<std::string> only, highlight;
  bool reset = false, keys = false, web = false;
};

// What the first scene is to show.
struct Shown {
  std::string colour_by, colour_table;
  std::vector<std::string> only, highlight;
};

void showIn(OpenedScene& scene, const TileSet* set, const Shown& shown) {
  if (!shown.only.empty() && set == nullptr)
    throw UsageError("--only: the scene is a file; ingest it, and give the set");
  if (!shown.only.empty()) scene.only = onlyCells(*set, shown.only);
  for (const std::string& name : shown.highlight)
    scene.highlighted.push_back(findCellNamed(*scene.store, name, "--highlight"));
  if (!shown.colour_table.empty()) scene.colours = readColourTable(*scene.store, shown.colour_table, Theme::dark);
}

OpenedScene openToView(const std::vector<std::string>& paths, const RemoteOptions& remote, const Shown& shown) {
  OpenedScene scene;
  scene.name = escaped(std::filesystem::path(paths.front()).filename().string(), 60);
  if (scene.name.empty()) scene.name = escaped(paths.front(), 60);
  if (paths.size() > 1) {
    scene.name += " and ";
    scene.name += std::to_string(paths.size() - 1);
    scene.name += " more";
  }
  scene.in_memory = std::all_of(paths.begin(), paths.end(), isFileScene);
  const Colouring colouring = parseColouring(shown.colour_by.empty() ? "cell" : shown.colour_by);
  if (scene.in_memory) {
    checkColouring(colouring, shown.colour_by, nullptr);
    Input input(paths);
    scene.store = buildTilesInMemory(input);
    if (scene.store->cell_count() == 0)
      throw InputError(inShort(paths.front()) + ": no usable neuron in it; filiform check says why");
    if (const std::string doubt = input.unitDoubt(); !doubt.empty()) std::cerr << "filiform: note: " << doubt << '\n';
    showIn(scene, nullptr, shown);
    return scene;
  }
  if (paths.size() > 1) throw UsageError("give one tile set, or any number of .swc and .zip files");
  auto set = TileSet::open(paths.front(), remote);
  checkColouring(colouring, shown.colour_by, set.get());
  const TileSet* const opened = set.get();
  scene.hold(std::move(set));
  showIn(scene, opened, shown);
  return scene;
}

PictureSize windowSize(const std::string& text) {
  const std::size_t cross = text.find('x');
  if (cross == std::string::npos) throw UsageError("--size " + inShort(text) + ": give WIDTHxHEIGHT, such as 1280x800");
  const double width = parseNumber("--size", text.substr(0, cross));
  const double height = parseNumber("--size", text.substr(cross + 1));
  for (const double side : {width, height})
    if (side != static_cast<int>(side) || side < 1 || side > Renderer::kMaxSize)
      throw UsageError("--size " + inShort(text) + ": each side is a whole number from 1 to " +
                       std::to_string(Renderer::kMaxSize));
  return {static_cast<int>(width), static_cast<int>(height)};
}

std::vector<NamedPath> namedInputs(const ViewArguments& a) {
  std::vector<NamedPath> inputs;
  for (const std::string& path : a.scene) inputs.push_back({"SCENE", path});
  inputs.push_back({"--device", fileOfDevice(a.device)});
  return inputs;
}

int runView(const ViewArguments& a) {
  if (a.keys) {
    std::cout << bindingsInMarkdown();
    return 0;
  }
  if (a.web) {
    if (a.scene.size() != 1 || isFileScene(a.scene.front())) throw UsageError("--web: give one tile set");
    std::string others;
    for (const std::string& option : a.given)
      if (option != "SCENE" && option != "--web" && !isRemoteOption(option))
        others += (others.empty() ? "" : " and ") + option;
    if (!others.empty()) throw UsageError("--web: travel in a browser has settings of its own; leave out " + others);
    return travelInBrowser(a.scene.front(), a.remote);
  }
  std::vector<NamedPath> outputs{{"--record", a.record}, {"--state", a.state}};
  if (isFileOutput(a.record)) outputs.push_back({"--record", a.record + ".json"});
  checkOutputs(namedInputs(a), outputs);
  std::error_code none;
  if (std::filesystem::exists(a.pictures, none) && !std::filesystem::is_directory(a.pictures, none))
    throw IoError("--pictures " + inShort(a.pictures), "is not a folder; name a folder for the screenshots");
  const RemoteOptions remote_options = a.remote->options();
  std::unique_ptr<Follow> follow;
  if (!a.follow.empty()) follow = std::make_unique<Follow>(a.follow, a.scene, remote_options.token);
  ApplicationOptions options;
  options.paths = a.scene;
  std::string colour_by = a.colour_by;
  if (!a.view.empty()) {
    if (!a.only.empty() || !a.highlight.empty())
      throw UsageError("--view: it says which cells are shown; leave out --only and --highlight");
    options.view = readViewFile(a.view);
    if (colour_by.empty() && a.colour_table.empty()) colour_by = options.view->colour_by;
    if (options.view->place) {
      const Vector3d& p = options.view->place->p_W;
      options.place = formatNumber(p.x()) + " " + formatNumber(p.y()) + " " + formatNumber(p.z());
    }
    options.size = options.view->size;
    options.theme = options.view->theme;
  }
  if (!colour_by.empty()) parseColouring(colour_by);  // refuses an unknown measure before the window opens
  options.colour_by = colour_by;
  const auto shown = std::make_shared<Shown>(Shown{colour_by, a.colour_table, a.only, a.highlight});
  options.open = [remote = remote_options, shown](const std::vector<std::string>& paths) {
    return openToView(paths, remote, std::exchange(*shown, {}));
  };
  options.write = [](const Picture& picture, const std::string& path) {
    const std::filesystem::path folder = std::filesystem::path(path).parent_path();
    std::error_code error;
    std::filesystem::create_directories(folder, error);
    if (error) throw IoError(inShort(folder.string()), "cannot make the folder for pictures", error.value());
    writePng(picture, path);
  };
  options.poll = [&follow] {
    throwIfInterrupted();
    if (follow) follow->throwIfRefused();
  };
  if (a.device.starts_with("replay:"))
    for (const char* const option : {"--method", "--zoom", "--leap", "--stiffness", "--buttons"})
      if (std::find(a.given.begin(), a.given.end(), option) != a.given.end())
        throw UsageError(std::string(option) + ": leave it out; a replay shows the travel as it was recorded");
  if (follow)
    options.observe = [&follow](const OpenedScene& scene, const NavigationSnapshot& now) {
      return follow->observe(scene, now);
    };
  options.plugged_in = [](const std::string& device) { return isPluggedIn(systemUsb(), device); };
  // The end may take long while a recording is written; then only silent files can delay it.
  constexpr double kDevicePatience_s = 30;
  EndingWatch whole = watchForSilentFiles({}, kDevicePatience_s), files = watchForSilentFiles();
  std::atomic<bool> ends{false};
  options.ending = [&] {
    ends = true;
    whole.begin();
  };
  options.session.ending = [&] {
    if (ends) files.begin();
  };
  options.session.device = a.device;
  options.session.method = solverMethod(a.method);
  const bool has_zoom = std::find(a.given.begin(), a.given.end(), "--zoom") != a.given.end();
  options.session.zoom_um = has_zoom || !options.view
                                ? a.zoom_um
                                : std::clamp(options.view->zoom_um, Workspace::kMinZoom_um, Workspace::kMaxZoom_um);
  options.session.leap = a.leap;
  options.session.stiffness_N_m = a.stiffness_N_m;
  std::optional<ButtonMap> buttons;
  if (!a.buttons.empty()) buttons = parseButtons(a.buttons);
  if (buttons && a.device == "mouse") throw UsageError("--buttons is for a device with buttons: give --device too");
  options.session.buttons = [buttons](const DeviceCapabilities& can) {
    return buttons ? buttons : savedButtons(can.name);
  };
  if (!a.budget.empty()) options.session.budget_bytes = parseBytes("--budget", a.budget);
  options.session.record = a.record;
  if (!a.size.empty()) options.size = windowSize(a.size);
  options.segments = a.segments;
  options.reset = a.reset;
  if (!a.theme.empty()) options.theme = themeOf(a.theme);
  options.state = a.state;
  options.pictures = options.tables = a.pictures;
  options.seconds = a.seconds;
  holdForcesOnSignals();
  runApplication(options);
  return 0;
}

}  // namespace

void addView(CLI::App& app, Chosen& chosen) {
  auto a = std::make_shared<ViewArguments>();
  CLI::App* command = app.add_subcommand("view", "Travel through a scene in a window, with a mouse or a haptic device");
  command->footer(
      "Example:\n  filiform view column.fil\n  filiform view cell.swc --device spacemouse\n"
      "  filiform view column.fil --record travel.rec; filiform view column.fil --device replay:travel.rec\n"
      "  filiform view column.fil --device falcon --follow ws://127.0.0.1:7878/v1/sets/column/desks/anna\n"
      "In the window, press h for a list of keys.");
  command
      ->add_option("SCENE", a->scene,
                   "tile set or its address, or .swc and small .zip files; none: drop a scene into the window")
      ->type_name("SET|FILE.swc");
  command
      ->add_option(
          "--device", a->device,
          "use mouse, falcon, spacemouse, gamepad, haply, bridge, sim:loose|medium|firm (mouse with that hand), "
          "replay:FILE or null")
      ->capture_default_str();
  command->add_option("--method", a->method, "find the proxy with basic, shading, force, force-listing or climb")
      ->capture_default_str();
  command->add_option("--zoom", a->zoom_um, "show this much tissue, um, across the workspace at the start")
      ->capture_default_str()
      ->check(CLI::Range(Workspace::kMinZoom_um, Workspace::kMaxZoom_um));
  command
      ->add_option("--leap", a->leap,
                   "multiply climb's range in a tick by this factor: 0 follows the neurite, 1 needs the least force")
      ->capture_default_str()
      ->check(CLI::Range(0.0, 1.0));
  command->add_option("--stiffness", a->stiffness_N_m, "stiffness of the spring to the proxy, N/m");
  command
      ->add_option("--buttons", a->buttons,
                   "give the device's buttons these actions: " + buttonActionNames() +
                       "; default: what filiform devices --setup has saved, or by the number of buttons")
      ->type_name("0=ACTION,...");
  command->add_option("--budget", a->budget,
                      "use at most this memory for the tiles near the hand, such as 64MiB; default: no limit");
  command->add_option("--segments", a->segments, "draw at most N segments; default: by the time of frames");
  command
      ->add_option("-o,--output,--record", a->record,
                   "record the hand, for --device replay:FILE; also writes FILE.json")
      ->type_name("FILE");
  command->add_option("--size", a->size, "size of the window, pixels")->type_name("WxH");
  command
      ->add_option("--pictures", a->pictures, "save screenshots and tables of bookmarks in this folder; made if needed")
      ->capture_default_str()
      ->type_name("DIR");
  command->add_option("--state", a->state, "write the state to this file, as JSON, ten times a second")
      ->type_name("FILE");
  command->add_option("--seconds", a->seconds, "end this long after the scene is open");
  command
      ->add_option(
          "--follow", a->follow,
          "show this hand in pages of a server that have the same set open; the page with ?desk=NAME shows the "
          "address")
      ->type_name("WS_URL");
  command->add_option("--colour-by", a->colour_by, kColouringHelp);
  command
      ->add_option("--colour-table", a->colour_table,
                   "colour the cells as this file says: a name, a tab and #rrggbb a line; other cells are grey")
      ->type_name("FILE.tsv")
      ->excludes(command->get_option("--colour-by"));
  command
      ->add_option(
          "--view", a->view,
          "begin with this view, which V in the window has saved: place, turn, zoom, colours, cells, bookmarks")
      ->type_name("FILE.json");
  command
      ->add_option("--only", a->only,
                   "hide all cells but this one, or those that meet a condition, or those named in a file, as in "
                   "filiform render; repeatable: all of them together")
      ->type_name("NAME|CONDITION|@FILE")
      ->allow_extra_args(false);
  command->add_option("--highlight", a->highlight, "choose this cell, which is drawn through the others; repeatable")
      ->type_name("CELL")
      ->allow_extra_args(false);
  command->add_option("--theme", a->theme, "draw on a light or dark ground, from now on")->type_name("light|dark");
  command->add_flag("--reset", a->reset, "reset the settings to defaults");
  command->add_flag("--web", a->web,
                    "travel in a browser instead of a window; only the options for a SET at an address go with it");
  command->add_flag("--keys", a->keys, "print keys and mouse actions as Markdown, and end");
  a->remote = addRemoteArguments(*command);
  command->callback([a, command, &chosen] {
    a->given = givenOptions(*command);
    chosen = [a] { return runView(*a); };
  });
}

}  // namespace filiform::tools
