// Compiles the examples in the comments of public headers, unchanged. An example is a run of comment lines indented by
// three blanks or more whose first line ends in `;`, `{` or within parentheses. The test reads every public header, and
// looks for its examples in this file: line by line, without the indentation, below a line that names the header.
// Declarations that an example needs come before that line.
#include "device/falcon/falcon.h"
#include "device/falcon/falcon_protocol.h"
#include "device/gamepad/gamepad.h"
#include "device/haply/haply_device.h"
#include "device/haply/simulated_haply.h"
#include "device/usb/usb_recording.h"
#include "device/usb/usb_transport.h"
#include "device/web_socket/web_socket.h"
#include "index/anatomy/anatomy_check.h"
#include "index/anatomy/input_anatomy.h"
#include "index/attributes/cell_attributes.h"
#include "index/attributes/cell_filter.h"
#include "index/cell/attribute_conditions.h"
#include "index/cell/cell_parts.h"
#include "index/circuits/circuit.h"
#include "index/circuits/placements.h"
#include "index/compare/cell_change.h"
#include "index/compare/set_changes.h"
#include "index/compare/trace_distance.h"
#include "index/contacts/contacts.h"
#include "index/file/faulty_source.h"
#include "index/file/future_read.h"
#include "index/formats/swc.h"
#include "index/hdf5/hdf5_writer.h"
#include "index/ingest/ingest.h"
#include "index/input/input.h"
#include "index/levels/levels.h"
#include "index/measure/neurite_density.h"
#include "index/measure/segment_looks.h"
#include "index/output.h"
#include "index/query/cell_pass.h"
#include "index/query/cell_paths.h"
#include "index/query/cell_sections.h"
#include "index/query/filtered_searches.h"
#include "index/query/kept_tiles.h"
#include "index/query/nearest.h"
#include "index/query/segment_pass.h"
#include "index/remote/http_source.h"
#include "index/set/tile_set.h"
#include "index/set/tiles_ahead.h"
#include "index/subsets/set_cells.h"
#include "index/subsets/subset.h"
#include "solver/force/force_gate.h"
#include "solver/graph/nearby_graph.h"
#include "solver/loop/haptic_loop.h"
#include "solver/loop/loop_gate.h"
#include "solver/loop/tick_clock.h"
#include "solver/travel/routes/tour.h"
#include "solver/travel/run/run.h"
#include "solver/travel/session/session.h"
#include "solver/travel/session/stepped_travel.h"
#include "solver/travel/session/worker.h"
#include "solver/workspace/navigation.h"
#include "solver/workspace/saved_history.h"
#include "tests/support/folders.h"
#include "tests/support/temp_folder.h"
#include "viewer/gl/renderer.h"
#include "viewer/gl/scene_view.h"
#include "viewer/window/window.h"

#include <algorithm>
#include <chrono>
#include <filesystem>
#include <fstream>
#include <functional>
#include <iostream>
#include <span>
#include <sstream>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include <gtest/gtest.h>

namespace filiform {
namespace {

// Examples are compiled, not run: they open devices, windows and files. Their line breaks are those of the headers.
// clang-format off
namespace examples {
#pragma GCC diagnostic push
#pragma GCC diagnostic ignored "-Wunused-function"
#pragma GCC diagnostic ignored "-Wunused-variable"
#pragma GCC diagnostic ignored "-Wunused-but-set-variable"
#pragma GCC diagnostic ignored "-Wshadow"

void httpSource() {
  // index/remote/http_source.h
  const auto set = TileSet::open("https://host/path/column.fil");
}

void futureRead(const TileStore& store, TileId now, TileId next, void draw(const Tile&)) {
  // index/file/future_read.h
  ReadThreads threads(2);
  FutureRead<std::shared_ptr<const Tile>> ahead(&threads, [&] { return store.load(next); });
  draw(*store.load(now));
  draw(*ahead.get());
}

void tilesAhead(const TileStore& store, const std::vector<TileId>& tiles, void use(TilesAhead::Loaded)) {
  // index/set/tiles_ahead.h
  TilesAhead ahead(store, tiles, true);
  for (std::size_t i = 0; i < tiles.size(); ++i) use(ahead.next());
}

void segmentPass(const std::unique_ptr<TileSet>& set) {
  // index/query/segment_pass.h
  double length_um = 0;
  forEachSegment(*set, {}, [&](TileId, std::span<const PassedSegment> segments) {
    for (const PassedSegment& s : segments) length_um += set->grid().toWorld(s.child - s.parent).norm();
  });
}

void cellPass(const std::unique_ptr<TileSet>& set, const std::vector<std::uint32_t>& ids, void use(CellGraph)) {
  // index/query/cell_pass.h
  CellPass cells(*set, ids);
  for (std::size_t i = 0; i < ids.size(); ++i) use(cells.next());
}

void contacts(const std::unique_ptr<TileSet>& set, const std::vector<std::uint32_t>& cells) {
  // index/contacts/contacts.h
  findContacts(*set, {.within_um = 2, .from = cells, .to = cells}, [&](const ContactSite& site) {
    std::cout << set->cell(site.sides[0].cell).name << " meets " << set->cell(site.sides[1].cell).name << " at "
              << site.sides[0].p_W.transpose() << ", " << site.distance_um << " um\n";
  });
}

void subset(const std::unique_ptr<TileSet>& set) {
  // index/subsets/subset.h
  std::vector<std::uint32_t> cells = CellFilter({"mtype=L5_*"}).select(*set, CellAttributes(*set));
  cells = cellsInBox(*set, cells, {set->grid().snap({0, 0, 0}), set->grid().snap({100, 100, 100})});
  SetCells stream(*set, cells);
  ingest(stream, "part.fil", {.provenance = [&] { return stream.provenance(); }});
}

void comparedCells(const std::unique_ptr<TileSet>& old_set, const std::unique_ptr<TileSet>& new_set, std::uint32_t a,
                   std::uint32_t b) {
  // index/compare/cell_change.h
  const CellChange change = compareCells(readCell(*old_set, a, true), readCell(*new_set, b, true));
  if (change.kind == CellFate::kChanged) std::cout << change.samples_added << " samples added\n";
}

void tracesCompared(const CellGraph& first, const CellGraph& second) {
  // index/compare/trace_distance.h
  const TraceDistance d = traceDistance(first, second, {.within_um = 2});
  std::cout << d.within_length_um / d.length_um << " of the first lies within 2 um of the second\n";
}

void setsCompared() {
  // index/compare/set_changes.h
  const auto before = TileSet::open("old.fil"), now = TileSet::open("new.fil");
  compareSets(*before, *now, {}, [](const CellDifference& cell) {
    if (cell.change.kind != CellFate::kSame) std::cout << cell.names[0] << ' ' << name(cell.change.kind) << '\n';
  });
}

void keptTiles(const std::unique_ptr<TileSet>& set, const std::vector<std::uint32_t>& cells, void use(CellGraph)) {
  // index/query/kept_tiles.h
  const KeptTiles kept(*set, 64 << 20);
  for (const std::uint32_t cell : cells) use(readCell(kept, cell, true));
}

void falcon(const Wrench& wrench) {
  // device/falcon/falcon.h
  Falcon falcon(systemUsb(), {.firmware = "falcon.bin"});
  falcon.open();      // probes the device; loads the firmware if it runs none: 0.1 s, or 3 s
  const DeviceState state = falcon.exchange(wrench);  // homing; ready after the grip was pulled out and pushed in
}

void gamepad(const Wrench& wrench) {
  // device/gamepad/gamepad.h
  Gamepad pad({.path = "/dev/input/event7"});
  pad.open();
  const DeviceState state = pad.exchange(wrench);   // rumbles with wrench.resistance
}

void webSocket() {
  // device/web_socket/web_socket.h
  WebSocket socket(64 * 1024);
  const WebSocket::Answer answer = socket.open(connectTcp("127.0.0.1", 7878, {}), {.host = "127.0.0.1:7878"}, 5);
  if (!socket.isOpen()) throw DeviceError(answer.trouble);
  socket.send(FrameKind::text, "hello", 1);
  const WebSocket::Message message = socket.receive(socket.stream().time_s() + 1);
}

void haply(const Wrench& wrench) {
  // device/haply/haply_device.h
  HaplyDevice haply(haplyOptions(",049D"));
  haply.open();                                      // homing, until the service says that the device is ready
  const DeviceState state = haply.exchange(wrench);  // one message to the service, one state back
}

void simulatedHaply() {
  // device/haply/simulated_haply.h
  SimulatedHaply service;
  HaplyOptions options;
  options.connect = service.connections();   // within this thread, in virtual time
  HaplyDevice haply(options);
}

void falconLoader(std::span<const std::uint8_t> image, double time_s, void send(const FtdiRequest&),
                  void write(std::span<const std::uint8_t>), std::span<const std::uint8_t> readUntil(double until_s),
                  void reopen()) {
  // device/falcon/falcon_protocol.h
  FalconLoader loader(image);
  for (;;) {
    const FalconLoader::Step& step = loader.next(time_s);
    using Action = FalconLoader::Action;
    if (step.action == Action::loaded || step.action == Action::failed) break;
    if (step.action == Action::request) send(step.request);
    if (step.action == Action::write) write(step.bytes);
    if (step.action == Action::read) loader.received(readUntil(step.until_s));  // some bytes, or none at that time
    if (step.action == Action::reopen) reopen();
  }
}

void usbRecorder() {
  // device/usb/usb_recording.h
  std::ofstream file("falcon.usb", std::ios::binary);
  UsbRecorder recorder(systemUsb(), file);
  {
    Falcon falcon(recorder);
    falcon.open();
  }
  recorder.finish();
}

void usbReplay() {
  // device/usb/usb_recording.h
  UsbReplay replay("falcon.usb");
  Falcon falcon(replay);
}

void usbTransport() {
  // device/usb/usb_transport.h
  for (const UsbDeviceInfo& info : systemUsb().devices()) std::cout << std::hex << info.vendor << '\n';
  const UsbDeviceInfo info = systemUsb().devices().at(0);
  std::unique_ptr<UsbConnection> usb = systemUsb().open(info);      // throws UsbError by cause
  usb->claim(0);
  std::unique_ptr<UsbTransfer> in = usb->makeTransfer(0x81, 64);
  in->submit(64);
  usb->handleEvents(0.002);                                         // on the calling thread
  if (in->status() == UsbStatus::done) std::cout << in->data().size() << '\n';
}

void cellPaths() {
  // index/query/cell_paths.h
  const auto set = TileSet::open("column.fil");
  const CellPaths paths(readCell(*set, 0, false));
  const CellPlace root = paths.at(0);
  if (const auto tip = paths.farthestTip(root))
    std::cout << paths.path(root, paths.at(*tip))->length_um() << " um\n";
}

void faultySource(const std::string& path) {
  // index/file/faulty_source.h
  auto source = std::make_unique<FaultySource>(openFolder(path), FaultPlan{.delay = FaultPlan::Delay::constant,
                                                                          .delay_s = 0.02});
  FaultySource& faults = *source;
  const auto set = TileSet::open(std::move(source));
  faults.arm();  // faults start here
}

void input() {
  // index/input/input.h
  Input input({"column.zip", "more/"});
  for (Cell cell; input.next(cell);) std::cout << cell.source << '\n';
  writeCheckTable(std::cout, input.reports());
}

void levels(const std::unique_ptr<TileSet>& set, const LevelView& view) {
  // index/levels/levels.h
  const auto levels = Levels::open(*set);
  const LevelChoice choice = levels->choose(view, 2'000'000);
  for (const LevelPart& part : choice.parts)
    const auto tile = part.level ? levels->load(part.tile) : set->load(part.tile);
}

void filteredSearches(const std::unique_ptr<TileSet>& set, const Vector3d& p_W) {
  // index/query/filtered_searches.h
  FilteredSearches searches(*set, 64 << 20);
  searches.with({.types = {2}})->find(p_W);
}

void segmentLooks(const Nearest& nearest, const Vector3d& p_W) {
  // index/measure/segment_looks.h
  SegmentLooks looks(nearest.tiles(), 64 << 20);
  for (const SegmentLook& look : looks.of(nearest.find(p_W, {.k = 3}))) std::cout << look.radius_um << '\n';
}

void neuriteDensity(const std::unique_ptr<TileSet>& set) {
  // index/measure/neurite_density.h
  const NeuriteDensity density = densityOf(*set, {.step_um = 50});
  for (double length_um : density.lengths_um) std::cout << length_um / density.box_um3() << '\n';  // um per um3
}

void nearest() {
  // index/query/nearest.h
  const auto set = TileSet::open("column.fil");
  const Nearest nearest(*set);
  for (const NearestResult& r : nearest.find(Vector3d(120, -40, 800), {.k = 3}))
    std::cout << set->cell(r.segment.cell).name << " at " << r.distance_um << " um\n";
}

void placements() {
  // index/circuits/placements.h
  Input library({"lib.zip"});
  PlacedCells cells(library, PlacementTable::read("column.tsv"));
  ingest(cells, "column.fil");
}

void swc(std::string_view text) {
  // index/formats/swc.h
  Cell cell;
  const InputReport report = readSwc(text, "cell.swc", {}, cell);
}

void tileSet() {
  // index/set/tile_set.h
  const auto set = TileSet::open("column.fil");
  const std::shared_ptr<const Tile> tile = set->load(0);
}

void hapticLoop(HapticDevice& device, Navigation& navigation, std::ostream& out) {
  // solver/loop/haptic_loop.h
  HapticLoop loop(device, [&](const DeviceState& state, double dt_s) {
    return navigation.tick(state, dt_s).wrench;
  });
  loop.start();
  std::this_thread::sleep_for(std::chrono::seconds(10));
  loop.stop();
  loop.metrics().writeCsv(out);
}

void navigate(const GraphView& graph, SolverMethod method, const SolverParameters& parameters,
              const NavigationOptions& options, const NavigationCommand& jump_command, const Eigen::Vector3d& h_D,
              const DeviceState& state, double dt_s) {
  // solver/workspace/navigation.h
  Navigation navigation(graph, makeProxySolver(method, parameters), options);
  navigation.apply(jump_command, h_D);                        // between ticks
  const NavigationTick& tick = navigation.tick(state, dt_s);  // tick.wrench goes to the next exchange
}

void savedHistory(const std::unique_ptr<TileSet>& set, const ProxyPlace& place) {
  // solver/workspace/saved_history.h
  SavedHistory saved(*set, SavedHistory::pathFor("column.fil"));
  if (!saved.warning().empty()) std::cerr << saved.warning() << '\n';  // one line for the user
  saved.history().setBookmark("soma", place);
  saved.save();
}

void headlessRun(const std::unique_ptr<TileSet>& set) {
  // solver/travel/run/run.h
  RunOptions options;
  options.route = {.kind = RouteChoice::Kind::random, .seed = 3};
  const RunSummary summary = run(*set, options, [](const TickRow& row) { writeCsvRow(std::cout, row); });
}

void tour(const TileStore& store, std::uint64_t seed) {
  // solver/travel/routes/tour.h
  Tour tour(store, seed);
  const Route first = tour.next(), second = tour.next();
}

void render(const Tile& tile, const TileAppearance& appearance, const Camera& camera, double aspect) {
  // viewer/gl/renderer.h
  const auto context = makeOffscreenContext();
  Renderer renderer(*context);
  renderer.put(1, makeBatch(tile, appearance));
  renderer.draw(stereoViews(camera, aspect, 0), {.size = {1280, 800}});
  const Picture picture = renderer.read();
}

void sceneView(const std::unique_ptr<TileSet>& set, const std::unique_ptr<Levels>& levels, Renderer& renderer,
               const Camera& camera, const Workspace& workspace, double now_s, const PictureSize& window) {
  // viewer/gl/scene_view.h
  SceneView scene(*set, levels.get(), renderer);
  for (;;) {
    const SceneFigures figures = scene.draw({.camera = camera, .workspace = &workspace, .time_s = now_s});
    renderer.present(window);
  }
}

void session(const std::unique_ptr<TileSet>& set, const ProxyPlace& place, const Vector3d& target_D) {
  // solver/travel/session/session.h
  Session session(*set, {.device = "mouse"});
  session.start();
  session.jump(place);
  for (;;) {
    const NavigationSnapshot& now = session.update();   // never waits
    session.point(Pointing::at(target_D));              // where the mouse pulls to
  }
}

void window(Renderer& renderer, const std::array<EyeView, 2>& views, const RenderOptions& options,
            void handle(const InputEvent&)) {
  // viewer/window/window.h
  Window window("filiform", {1280, 800});
  while (window.isOpen()) {
    for (const InputEvent& event : window.poll(0)) handle(event);
    renderer.draw(views, options);
    window.beginPanels();
    window.endPanels();
    renderer.present(window.size());
    window.drawPanels();
    window.show();
  }
}

void worker(const Nearest& nearest, const Vector3d& p_W, void go(const std::vector<NearestResult>&),
            const std::function<void(const std::string&)>& showError) {
  // solver/travel/session/worker.h
  Worker worker;
  worker.ask([&] { return [&go, place = nearest.find(p_W)] { go(place); }; });
  worker.serve(showError);  // once a frame: runs what the finished works returned
}

void output() {
  // index/output.h
  Output csv("travel.csv");
  csv.stream() << "tick,time_s\n";
  csv.finish();  // without this call an older travel.csv stays unchanged
}

void forceGate(const ForceGateOptions& options, const Wrench& wrench, double dt_s) {
  // solver/force/force_gate.h
  ForceGate gate(options);
  Wrench sent = gate.pass({.wanted = wrench, .dt_s = dt_s});     // once a tick
  gate.close();     // zero now; then force grows from zero over the ramp
  gate.restart();   // what is sent now fades to zero; then force grows from zero over the ramp
}

void loopGate(const LoopGateOptions& options, HapticDevice& device, bool too_old, double now_s, bool withheld,
              const std::function<Wrench(const DeviceState&, double)>& tick) {
  // solver/loop/loop_gate.h
  LoopGate gate(options);
  if (too_old) gate.interrupt();
  DeviceState state = device.exchange(gate.wrench());
  const double dt_s = gate.take(state, now_s);               // fills in state.sent_N
  gate.put(tick(state, dt_s), withheld);
}

void tickClock(double rate_Hz, const DeviceState& state) {
  // solver/loop/tick_clock.h
  TickClock clock(1 / rate_Hz);
  const double dt_s = clock.step_s(state.time_s);      // once for each state
}

void circuit(const InputOptions& options) {
  // index/circuits/circuit.h
  Circuit circuit = Circuit::read("circuit_config.json", {});
  Input library(circuit.files(), options);
  CircuitCells cells(library, circuit);
  ingest(cells, "column.fil");
}

void hdf5Writer(std::span<const double> x) {
  // index/hdf5/hdf5_writer.h
  Hdf5Writer out("nodes.h5");
  out.reals("nodes/column/0/x", "f64", 1, x);
  out.finish();
}

void anatomyCheck(const Cell& cell) {
  // index/anatomy/anatomy_check.h
  AnatomyCheck check;
  for (const Finding& finding : check.of(cell)) std::cout << name(finding.kind) << ": " << finding.text << '\n';
}

void inputAnatomy(Input& input) {
  // index/anatomy/input_anatomy.h
  InputAnatomy anatomy;
  for (Cell cell; input.next(cell);) anatomy.add(cell);
  anatomy.finish();
  for (const CellFindings& cell : anatomy.cells()) std::cout << cell.source << '\n';
}

void cellSections(const std::unique_ptr<TileSet>& set) {
  // index/query/cell_sections.h
  const CellPaths paths(readCell(*set, 0, true));
  const CellSections sections(paths);
  const auto [section, pos] = sections.of(paths.at(7));
  std::cout << section << ' ' << pos << '\n';
}

void cellParts(const Cell& whole) {
  // index/cell/cell_parts.h
  for (const Cell& cell : cellPartsOf(whole).cells) std::cout << cell.name << '\n';
}

void attributeConditions() {
  // index/cell/attribute_conditions.h
  const AttributeConditions conditions({"mtype=L5_*", "layer>=4"});
  std::cout << conditions.all().front().meets(AttributeValue("L5_TPC:A")) << '\n';
}

void cellFilter(const std::unique_ptr<TileSet>& set, const CellAttributes& attributes) {
  // index/attributes/cell_filter.h
  const CellFilter filter({"mtype=L5_*", "layer>=4"});
  for (std::uint32_t cell : filter.select(*set, attributes)) std::cout << set->cell(cell).name << '\n';
}

void cellAttributes(const std::unique_ptr<TileSet>& set, std::uint32_t cell) {
  // index/attributes/cell_attributes.h
  const CellAttributes attributes(*set);
  if (const auto mtype = attributes.find("mtype")) std::cout << textOf(attributes.value(*mtype, cell)) << '\n';
}

void nearbyGraph(const GraphView& graph, const ProxyPlace& place, void draw(const Vector3d&, const Vector3d&)) {
  // solver/graph/nearby_graph.h
  NearbyGraph around(512);
  around.collect(graph, place, 40);   // um
  for (const auto& [a, b] : around.links()) draw(around.nodes()[a], around.nodes()[b]);
}

void steppedTravel(const std::unique_ptr<TileSet>& set, Vector3d p_W, const Vector3d& hand_D, Vector3d& force_N) {
  // solver/travel/session/stepped_travel.h
  const NearestResult start = Nearest(*set).find(p_W).at(0);
  SteppedTravel travel(*set);
  travel.jump(start.tile, start.segment, start.t);
  for (;;) force_N = travel.tick(hand_D, 0.001).wrench.force_N;
}

#pragma GCC diagnostic pop
}  // namespace examples
// clang-format on

std::string stripped(const std::string& line) {
  const std::size_t begin = line.find_first_not_of(' ');
  return begin == std::string::npos ? "" : line.substr(begin, line.find_last_not_of(' ') + 1 - begin);
}

std::vector<std::string> linesOf(const std::string& path) {
  std::vector<std::string> lines;
  std::istringstream text(test::readBytes(path));
  for (std::string line; std::getline(text, line);) lines.push_back(stripped(line));
  return lines;
}

bool isCode(const std::string& line) {
  const std::string code = stripped(line.substr(0, line.find("//")));
  return code.ends_with(';') || code.ends_with('{') ||
         std::count(code.begin(), code.end(), '(') > std::count(code.begin(), code.end(), ')');
}

std::vector<std::vector<std::string>> examplesOf(const std::string& header) {
  std::vector<std::vector<std::string>> examples;
  enum class Within { nothing, example, prose } within = Within::nothing;
  for (const std::string& line : linesOf(header)) {
    if (!line.starts_with("//   ")) {
      within = Within::nothing;
      continue;
    }
    const std::string text = stripped(line.substr(2));
    if (within == Within::nothing) {
      within = isCode(text) ? Within::example : Within::prose;
      if (within == Within::example) examples.emplace_back();
    }
    if (within == Within::example) examples.back().push_back(text);
  }
  return examples;
}

TEST(HeaderExamples, AllAreCompiledHereAsTheyStandThere) {
  const std::vector<std::string> here = linesOf(test::inSource("tests/viewer/header_examples_test.cpp"));
  std::size_t count = 0;
  for (const char* room : {"index", "device", "solver", "viewer"})
    for (const auto& entry : std::filesystem::recursive_directory_iterator(test::inSource(std::string(room)))) {
      if (entry.path().extension() != ".h" || entry.path().parent_path().filename() == "internal") continue;
      const std::string header = entry.path().lexically_relative(test::inSource("")).string();
      for (std::vector<std::string> example : examplesOf(entry.path().string())) {
        ++count;
        std::string text;
        for (const std::string& line : example) text += "  " + line + "\n";
        example.insert(example.begin(), "// " + header);
        EXPECT_NE(std::search(here.begin(), here.end(), example.begin(), example.end()), here.end())
            << header << " has an example that is not compiled here:\n"
            << text;
      }
    }
  EXPECT_EQ(count, 56u) << "examples; a new one goes into this file";
}

TEST(HeaderExamples, AnExampleIsTold) {
  const test::TempFolder folder;
  test::writeBytes(
      folder / "a.h",
      "// Says.\n//\n//   Thing thing;  // makes it\n//     thing.go();\n//\n// And:\n//   words, and\n//   more\n"
      "//\n//   f = K (p - h)\n#pragma once\n");
  EXPECT_EQ(examplesOf(folder / "a.h"),
            (std::vector<std::vector<std::string>>{{"Thing thing;  // makes it", "thing.go();"}}));
}

}  // namespace
}  // namespace filiform
