// filiform devices: lists the devices that are plugged in, says what they lack, and tests them.
#include "device/check/found_devices.h"
#include "device/factory/device_factory.h"
#include "device/haply/simulated_haply_server.h"
#include "device/usb/usb_recording.h"
#include "index/errors.h"
#include "index/output.h"
#include "index/text.h"
#include "solver/loop/device_setup.h"
#include "solver/loop/device_test.h"
#include "solver/workspace/button_map.h"
#include "tools/commands/commands.h"
#include "tools/program/interruption.h"
#include "tools/program/output_check.h"
#include "tools/words/device_report.h"
#include "tools/words/numbers.h"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <exception>
#include <iostream>
#include <optional>
#include <thread>

#include <CLI/CLI.hpp>
#include <nlohmann/json.hpp>

namespace filiform::tools {

namespace {

struct DevicesArguments {
  bool json = false, test = false, setup = false;
  std::string device, record, report;
  std::optional<int> simulated_port;
};

struct Recognised {
  const char* ids;
  const char* kind;
  const char* device;
};

constexpr Recognised kRecognised[] = {
    {"0403:cb48", "Novint Falcon", "falcon[:FIRMWARE][,SOCKET]"},
    {"046d:c6xx, 256f:*", "3Dconnexion mice with six axes, and their receivers", "spacemouse[:SOCKET]"},
    {"/dev/input", "gamepads of the kernel's input system", "gamepad[:NODE]"},
    {"-", "Haply Inverse3, through the Haply Inverse Service", "haply[:HOST:PORT][,ID]"},
    {"socket", "devices behind a bridge (device/BRIDGE.md)", "bridge[:PATH]"}};

std::string idsOf(const UsbDeviceInfo& info) {
  if (info.vendor == 0) return "-";
  char ids[16];
  std::snprintf(ids, sizeof ids, "%04x:%04x", info.vendor, info.product);
  return ids;
}

const char* const kServiceRemedy =
    "needed for a Haply Inverse3 only: install the Haply Inverse Service, then systemctl start haply-inverse-service; "
    "FILIFORM_HAPLY_SERVICE=HOST:PORT names one elsewhere";
constexpr double kServiceTime_s = 0.5;
const char* const kNoDeviceRemedy = "connect the USB cable and the power supply of the Inverse3";

const char* serviceState(const HaplyServiceState& service) {
  if (!service.runs) return "not running";
  return service.devices.empty() ? "running, without a device" : "running";
}

void printService(const HaplyServiceState& service) {
  std::cout << "Haply Inverse Service at " << escaped(service.address) << ": " << serviceState(service) << '\n';
  if (!service.runs)
    std::cout << "  reason   " << escaped(service.trouble) << "\n  missing  " << kServiceRemedy << '\n';
  else if (service.devices.empty())
    std::cout << "  missing  " << kNoDeviceRemedy << '\n';
}

void printTable(const std::vector<FoundDevice>& found, const std::string& refusal, const HaplyServiceState& service) {
  for (const FoundDevice& device : found) {
    if (!device.info.bus_path.empty()) std::cout << device.info.bus_path << "  " << idsOf(device.info) << "  ";
    std::cout << device.kind;
    if (!device.info.product_name.empty()) std::cout << " (" << escaped(device.info.product_name) << ')';
    std::cout << "\n  use      --device " << escaped(device.device) << "\n  state    " << device.state << '\n';
    if (!device.settings.empty()) std::cout << "  settings " << inShort(device.settings) << '\n';
    if (!device.remedy.empty()) std::cout << "  missing  " << device.remedy << '\n';
  }
  if (found.empty()) {
    if (!refusal.empty()) std::cout << refusal << '\n';
    std::cout << "no device that filiform can use is plugged in; filiform recognises\n";
    for (const Recognised& r : kRecognised) std::cout << "  " << r.ids << "  " << r.kind << ", as " << r.device << '\n';
  }
  printService(service);
  std::cout << "without hardware: sim:loose, sim:medium, sim:firm, replay:FILE, null\n";
}

nlohmann::ordered_json asJson(const FoundDevice& device) {
  nlohmann::ordered_json json{{"bus_path", device.info.bus_path},
                              {"ids", idsOf(device.info)},
                              {"kind", device.kind},
                              {"name", device.info.product_name},
                              {"serial", device.info.serial},
                              {"device", device.device},
                              {"state", device.state},
                              {"remedy", nullptr}};
  if (!device.settings.empty()) json["settings"] = device.settings;
  if (!device.remedy.empty()) json["remedy"] = device.remedy;
  if (device.info.bus_path.empty()) json["bus_path"] = json["ids"] = nullptr;
  return json;
}

nlohmann::ordered_json asJson(const DeviceCheck& c) {
  return {{"homing_s", c.homing_s},
          {"exchanges", c.exchanges},
          {"seconds", c.seconds},
          {"rate_Hz", c.rate_Hz},
          {"longest_gap_s", c.longest_gap_s},
          {"reports", c.reports},
          {"buttons", c.buttons},
          {"force_N", c.force_N},
          {"moved_m", {c.moved_m.x(), c.moved_m.y(), c.moved_m.z()}},
          {"stopped", c.stopped},
          {"wrong_direction", c.wrong_direction},
          {"refusals", c.refusals}};
}

void print(std::ostream& out, const std::string& device, const DeviceCapabilities& capabilities, const DeviceCheck& c) {
  out << escaped(device) << ": " << escaped(capabilities.name) << '\n'
      << "  homing   " << (capabilities.needs_homing ? fixed(c.homing_s, 1) + " s" : "not needed") << '\n'
      << "  reading  " << counted(c.exchanges, "exchange") << " in " << fixed(c.seconds, 2) << " s, "
      << formatCount(static_cast<std::uint64_t>(std::llround(c.rate_Hz))) << " Hz; longest gap "
      << formatCount(static_cast<std::uint64_t>(std::llround(1e6 * c.longest_gap_s))) << " us; "
      << counted(c.reports, "report") << "\n";
  out << "  buttons  ";
  if (c.buttons == 0) out << "none pressed";
  for (int i = 0; i < 32; ++i)
    if (c.buttons >> i & 1u) out << i << ' ';
  out << "\n  force    ";
  if (capabilities.peak_force_N > 0) {
    out << fixed(c.force_N, 2) << " N along x, y, z: the hand gave way by";
    for (int axis = 0; axis < 3; ++axis) out << (axis > 0 ? ", " : " ") << fixed(1e3 * c.moved_m[axis], 1);
    out << " mm" << (c.stopped ? "; stopped: the hand moved too far" : "") << '\n';
  } else {
    out << "not rendered by this device\n";
  }
  if (!c.wrong_direction.empty()) out << "  wrong    " << escaped(c.wrong_direction) << '\n';
  if (c.walk) printWalk(out, *c.walk, capabilities.peak_force_N > 0);
  for (const std::string& refusal : c.refusals) out << "  note     " << refusal << '\n';
}

// Keeps the traffic of a test that fails, because the traffic shows the reason. An older file stays.
class KeptTraffic {
 public:
  KeptTraffic(Output* output, UsbRecorder* recorder) : output_(output), recorder_(recorder) {}
  ~KeptTraffic() {
    if (std::uncaught_exceptions() == exceptions_ || output_ == nullptr) return;
    try {
      recorder_->finish();
      const std::string kept = output_->finishAside();
      if (kept != output_->path()) std::cerr << "filiform: note: the traffic so far is in " << inShort(kept) << '\n';
    } catch (const std::exception&) {
      // The first failure is reported.
    }
  }
  KeptTraffic(const KeptTraffic&) = delete;
  KeptTraffic& operator=(const KeptTraffic&) = delete;

 private:
  Output* output_;
  UsbRecorder* recorder_;
  int exceptions_ = std::uncaught_exceptions();
};

// Serves a simulated Haply service, whose hand moves in real time, until a signal.
int simulateHaply(int port) {
  using Clock = std::chrono::steady_clock;
  SimulatedHaplyOptions options;
  options.is_led = true;
  options.clock = [begin = Clock::now()] { return std::chrono::duration<double>(Clock::now() - begin).count(); };
  SimulatedHaply service(options);
  const SimulatedHaplyServer server(service, static_cast<std::uint16_t>(port));
  std::cout << "simulated Haply Inverse Service: use --device haply:127.0.0.1:" << server.port() << std::endl;
  while (!interruptFlag()) std::this_thread::sleep_for(std::chrono::milliseconds(20));
  return 0;
}

// The device that was named, else the first that is ready.
std::string chosenDevice(const std::string& named, const std::vector<FoundDevice>& found, const std::string& refusal) {
  if (!named.empty()) return named;
  if (found.empty())
    throw DeviceError(refusal.empty() ? "no device is plugged in; filiform devices --test sim:medium tries the test "
                                        "without hardware"
                                      : refusal);
  const auto ready = std::find_if(found.begin(), found.end(), [](const FoundDevice& d) { return d.state == "ready"; });
  return (ready != found.end() ? *ready : found.front()).device;
}

bool hasHandle(const std::string& device) {
  return !device.starts_with("sim") && !device.starts_with("replay:") && device != "null";
}

int setUp(const std::string& spec) {
  static_cast<void>(savedButtons(""));  // a damaged file is refused before the walk
  const std::unique_ptr<HapticDevice> device = makeDevice(spec);
  DeviceSetupOptions options;
  options.check.tell = [](const std::string& text) { std::cerr << text << '\n'; };
  options.check.poll = [] { throwIfInterrupted(); };
  options.ask = [](const std::string& question) {
    std::string answer;
    std::cerr << question << std::flush;
    std::getline(std::cin, answer);
    throwIfInterrupted();
    if (!std::cin) throw UsageError("--setup: the input ended before the last answer; run it in a terminal");
    return answer;
  };
  const ButtonMap map = setUpDevice(*device, options);
  saveButtons(device->capabilities().name, map);
  std::cout << escaped(device->capabilities().name) << ": " << buttonsText(map) << "; saved in " << buttonsFile()
            << "\nnow travel: filiform view SCENE --device " << escaped(spec) << '\n';
  return 0;
}

int runDevices(const DevicesArguments& a) {
  if (a.simulated_port) return simulateHaply(*a.simulated_port);
  std::vector<FoundDevice> found;
  std::string refusal;
  try {
    found = findDevices(systemUsb());
  } catch (const DeviceError& error) {
    refusal = error.what();
  }
  for (FoundDevice& pad : findPads()) found.push_back(std::move(pad));
  for (FoundDevice& bridge : findBridgedDevices()) found.push_back(std::move(bridge));
  const HaplyServiceState service = askHaplyService(haplyOptions(""), kServiceTime_s, true);
  for (FoundDevice& device : devicesOf(service)) found.push_back(std::move(device));
  nlohmann::ordered_json json{{"devices", nlohmann::ordered_json::array()},
                              {"recognised", nlohmann::ordered_json::array()},
                              {"refusal", nullptr},
                              {"haply_service",
                               {{"address", service.address},
                                {"state", serviceState(service)},
                                {"version", service.version},
                                {"grips", service.grips},
                                {"remedy", nullptr}}}};
  if (!service.runs) json["haply_service"]["remedy"] = service.trouble + ": " + kServiceRemedy;
  if (service.runs && service.devices.empty()) json["haply_service"]["remedy"] = kNoDeviceRemedy;
  for (const FoundDevice& device : found) json["devices"].push_back(asJson(device));
  for (const Recognised& r : kRecognised)
    json["recognised"].push_back({{"ids", r.ids}, {"kind", r.kind}, {"device", r.device}});
  if (!refusal.empty()) json["refusal"] = refusal;

  if (!a.record.empty() && !a.test) throw UsageError("--record needs --test: it writes the traffic of the test");
  if (!a.report.empty() && !a.test) throw UsageError("--report needs --test: it writes the results of the test");
  if (a.setup) return setUp(chosenDevice(a.device, found, refusal));
  if (!a.test && !a.json) printTable(found, refusal, service);
  if (a.test) {
    const std::string spec = chosenDevice(a.device, found, refusal);
    std::vector<NamedPath> outputs{{"--record", a.record}, {"--report", a.report}};
    if (a.json) outputs.push_back({"--json", "-"});
    checkOutputs({{"--test", fileOfDevice(spec)}}, outputs);
    std::unique_ptr<Output> record;         // outlives the recorder
    std::unique_ptr<UsbRecorder> recorder;  // outlives the device
    if (!a.record.empty()) {
      record = std::make_unique<Output>(a.record, OutputOptions{.cancel = &interruptFlag()});
      recorder = std::make_unique<UsbRecorder>(systemUsb(), record->stream());
    }
    const KeptTraffic kept(record.get(), recorder.get());
    std::unique_ptr<Output> report;
    if (!a.report.empty()) report = std::make_unique<Output>(a.report, OutputOptions{.cancel = &interruptFlag()});
    const std::unique_ptr<HapticDevice> device =
        makeDevice(spec, {.direct = report != nullptr, .usb = recorder.get()});  // a report is of the driver itself
    DeviceCheckOptions options;
    options.tell = [](const std::string& text) { std::cerr << text << '\n'; };
    options.poll = [] { throwIfInterrupted(); };
    options.directions = hasHandle(spec);
    if (report) options.walk.emplace();
    if (report && spec.starts_with("sim"))  // no person has to read or to move the hand
      options.walk->workspace_s = options.walk->damping_s = options.walk->pause_s = 0.5;
    const DeviceCheck check = checkDevice(*device, options);
    if (report) {
      report->stream()
          << deviceReport(spec, *device, check).dump(1, ' ', true, nlohmann::json::error_handler_t::replace) << '\n';
      report->finish();
    }
    if (recorder) {
      recorder->finish();
      record->finish();
    }
    json["test"] = asJson(check);
    json["test"]["device"] = spec;
    json["test"]["name"] = device->capabilities().name;
    if (!a.json)
      print((record && record->isStandardOutput()) || (report && report->isStandardOutput()) ? std::cerr : std::cout,
            spec, device->capabilities(), check);
  }
  if (a.json) std::cout << json.dump(1, ' ', true, nlohmann::json::error_handler_t::replace) << '\n';
  return 0;
}

}  // namespace

void addDevices(CLI::App& app, Chosen& chosen) {
  auto a = std::make_shared<DevicesArguments>();
  CLI::App* command = app.add_subcommand("devices", "List the devices that are plugged in; test one");
  command->footer(
      "Example:\n  filiform devices\n  filiform devices --setup haply\n  filiform devices --test falcon:falcon.bin\n  "
      "filiform devices --test "
      "sim:medium --json\n  filiform devices --simulate-haply &\nThe test homes the device and reads it for a second. "
      "If the device renders force, the test "
      "then ramps half a newton along x, y and z.\n--report also tests workspace, gravity, springs, damping and "
      "stability, "
      "with at most half a newton, and tells what to do with the handle.");
  command->add_flag("--json", a->json, "write one JSON object");
  command
      ->add_option_function<std::string>(
          "--test",
          [a](const std::string& device) {
            a->test = true;
            a->device = device;
          },
          "test a device: the one named, or the first that is plugged in")
      ->expected(0, 1)
      ->type_name("[DEVICE]");
  command
      ->add_option_function<std::string>(
          "--setup",
          [a](const std::string& device) {
            a->setup = true;
            a->device = device;
          },
          "set a device up with you: push its handle, press its buttons, name their actions; saves them for view")
      ->expected(0, 1)
      ->excludes("--test", "--json")
      ->type_name("[DEVICE]");
  command->add_option("-o,--output,--record", a->record, "write the USB traffic of the test (device/PROTOCOL.md)")
      ->type_name("FILE");
  command
      ->add_option("--report", a->report,
                   "walk through all tests of a device and write a report that may be sent (JSON)")
      ->type_name("FILE");
  command
      ->add_option_function<std::string>(
          "--simulate-haply",
          [a](const std::string& port) { a->simulated_port = port.empty() ? 10001 : std::stoi(port); },
          "serve a simulated Haply service with an Inverse3 on this port of 127.0.0.1, until Ctrl-C; without PORT "
          "10001; 0: a free one")
      ->expected(0, 1)
      ->check(CLI::Range(0, 65535))
      ->excludes("--test", "--setup", "--json", "--report", "--record")
      ->type_name("[PORT]");
  command->callback([a, &chosen] { chosen = [a] { return runDevices(*a); }; });
}

}  // namespace filiform::tools
