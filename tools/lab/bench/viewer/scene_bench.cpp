// bench scene: the cost of a scene from the start of the program. Checks that unused features cost nothing.
#include "index/errors.h"
#include "index/ingest/ingest.h"
#include "index/set/tile_set.h"
#include "tools/lab/bench/trade.h"
#include "tools/lab/bench/workloads.h"
#include "tools/synthetic/synthetic.h"

#include <algorithm>
#include <cerrno>
#include <chrono>
#include <cstring>
#include <fcntl.h>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <set>
#include <spawn.h>
#include <stdexcept>
#include <sys/resource.h>
#include <sys/wait.h>
#include <thread>
#include <unistd.h>

namespace filiform::tools {

namespace {

namespace fs = std::filesystem;
using Clock = std::chrono::steady_clock;

struct Start {  // one start of the program, measured until it ends
  double wall_ms = 0, cpu_ms = 0, peak_mib = 0;
  std::size_t threads = 0;  // largest number at a time, as seen from outside every 0.2 ms
  std::set<std::string> libraries, set_files;
};

std::set<std::string> mapped(pid_t process) {
  std::set<std::string> names;
  std::ifstream maps("/proc/" + std::to_string(process) + "/maps");
  for (std::string line; std::getline(maps, line);) {
    const std::size_t slash = line.find('/');
    if (slash == std::string::npos) continue;
    const std::string file = fs::path(line.substr(slash)).filename().string();
    if (file.find(".so") != std::string::npos && file.find("ld-linux") == std::string::npos) names.insert(file);
  }
  return names;
}

// The peak memory since the process became this program. The figure of getrusage() includes the parent's memory.
double peakMib(pid_t process) {
  std::ifstream status("/proc/" + std::to_string(process) + "/status");
  for (std::string line; std::getline(status, line);)
    if (line.starts_with("VmHWM:")) return std::stod(line.substr(6)) / 1024;
  return 0;
}

// Adds the files of tile sets that the process has open.
void addOpened(pid_t process, std::set<std::string>& names) {
  std::error_code ignored;
  for (fs::directory_iterator it("/proc/" + std::to_string(process) + "/fd", ignored), end; it != end;
       it.increment(ignored)) {
    const fs::path target = fs::read_symlink(it->path(), ignored);
    if (target.string().find(".fil/") != std::string::npos) names.insert(target.filename().string());
    if (ignored) break;
  }
}

Start startOnce(const std::vector<std::string>& arguments, bool watched) {
  const std::string program = (fs::read_symlink("/proc/self/exe").parent_path() / "filiform").string();
  std::vector<char*> argv{const_cast<char*>(program.c_str())};
  for (const std::string& argument : arguments) argv.push_back(const_cast<char*>(argument.c_str()));
  argv.push_back(nullptr);
  const auto started = Clock::now();
  posix_spawn_file_actions_t actions;
  posix_spawn_file_actions_init(&actions);
  for (const int stream : {STDOUT_FILENO, STDERR_FILENO})
    posix_spawn_file_actions_addopen(&actions, stream, "/dev/null", O_WRONLY, 0);
  pid_t child = 0;
  const int refused = ::posix_spawn(&child, argv[0], &actions, nullptr, argv.data(), environ);
  posix_spawn_file_actions_destroy(&actions);
  if (refused != 0) throw std::runtime_error(std::string("posix_spawn: ") + std::strerror(refused));
  Start start;
  int status = 0;
  rusage usage{};
  for (pid_t ended = 0; ended == 0;) {
    ended = ::wait4(child, &status, watched ? WNOHANG : 0, &usage);
    if (ended < 0 && errno == EINTR) ended = 0;
    if (ended != 0) break;
    std::error_code ignored;
    std::size_t threads = 0;
    for (fs::directory_iterator it("/proc/" + std::to_string(child) + "/task", ignored), end; !ignored && it != end;
         it.increment(ignored))
      ++threads;
    start.threads = std::max(start.threads, threads);
    start.libraries.merge(mapped(child));
    start.peak_mib = std::max(start.peak_mib, peakMib(child));
    addOpened(child, start.set_files);
    std::this_thread::sleep_for(std::chrono::microseconds(200));
  }
  start.wall_ms = std::chrono::duration<double, std::milli>(Clock::now() - started).count();
  if (!WIFEXITED(status) || WEXITSTATUS(status) != 0) {
    std::string command;
    for (const std::string& argument : arguments) command += " " + argument;
    throw std::runtime_error("filiform" + command + " did not succeed");
  }
  const auto ms = [](const timeval& t) {
    return 1e3 * static_cast<double>(t.tv_sec) + 1e-3 * static_cast<double>(t.tv_usec);
  };
  start.cpu_ms = ms(usage.ru_utime) + ms(usage.ru_stime);
  return start;
}

void writeSwcFile(const std::string& path, std::size_t segments, bool radii) {
  std::ofstream file(path, std::ios::binary);
  for (std::size_t i = 0; i <= segments; ++i) {
    // A neurite that winds, with a twig at every tenth sample.
    const double x = 0.9 * static_cast<double>(i);
    file << i + 1 << " 3 " << x << ' ' << static_cast<double>(i % 7) << ' ' << static_cast<double>(i % 3) << ' '
         << (radii ? "0.5" : "0") << ' ' << (i == 0 ? -1 : static_cast<long>(i % 10 == 9 && i > 2 ? i - 1 : i)) << '\n';
  }
  if (!file) throw IoError(path, "could not be written", errno);
}

void writeSwcFile(const std::string& path, const Cell& cell) {
  std::ofstream file(path, std::ios::binary);
  file.precision(9);
  for (std::size_t i = 0; i < cell.samples(); ++i) {
    const Vector3d& p_W = cell.positions_um[i];
    const std::uint32_t parent = cell.parents[i];
    file << i + 1 << ' ' << static_cast<int>(cell.types[i]) << ' ' << p_W.x() << ' ' << p_W.y() << ' ' << p_W.z() << ' '
         << cell.radii_um[i] << ' ' << (parent == kNoParent ? -1 : static_cast<long>(parent) + 1) << '\n';
  }
  if (!file) throw IoError(path, "could not be written", errno);
}

std::string joined(const std::set<std::string>& names) {
  std::string text;
  for (const std::string& name : names) text += (text.empty() ? "" : " ") + name;
  return text.empty() ? "-" : text;
}

BenchReport runScene(const BenchOptions& options) {
  BenchReport report;
  const WorkFolder folder(options.out, "scene");
  const std::string at = folder.path() + "/";
  options.progress("making the scenes");
  writeSwcFile(at + "one.swc", 1, true);
  writeSwcFile(at + "thousand.swc", 1000, true);
  writeSwcFile(at + "bare.swc", 1000, false);
  writeSwcFile(at + "thread.swc", 5000, true);
  SyntheticOptions neuron;
  neuron.cells = 1;
  neuron.seed = options.seed;
  SyntheticCells neurons(neuron);
  Cell one_cell;
  if (!neurons.next(one_cell)) throw std::logic_error("no neuron was grown");
  writeSwcFile(at + "cell.swc", one_cell);
  const auto makeSet = [&](const std::string& path, std::uint64_t segments) {
    measureInChild([&] {
      SyntheticOptions column;
      column.cells = static_cast<std::uint32_t>(std::max<std::uint64_t>(2, segments / 4500));
      column.seed = options.seed;
      SyntheticCells cells(column);
      ingest(cells, path, {});
      return std::vector<double>{};
    });
  };
  const std::uint64_t large = options.quick ? 20'000 : options.segments != 0 ? options.segments : 1'000'000;
  makeSet(at + "large.fil", large);

  struct Case {
    std::string name;
    std::vector<std::string> arguments;
    bool may_fail = false;  // needs hardware or software that the machine may lack
  };
  const std::string once = "0.001";  // s of simulated time: one tick
  std::vector<Case> cases{
      {"the program alone", {"--version"}},
      {"1 segment", {"navigate", at + "one.swc", "--seconds", once}},
      {"1000 segments", {"navigate", at + "thousand.swc", "--seconds", once}},
      {"1000 segments, no radii", {"navigate", at + "bare.swc", "--seconds", once}},
      {"one neurite, 5000 segments, 4.5 mm", {"navigate", at + "thread.swc", "--seconds", once}},
      {"one cell", {"navigate", at + "cell.swc", "--seconds", once}},
      {"one cell, real time", {"navigate", at + "cell.swc", "--seconds", "0.02", "--realtime"}},
      {"one cell, no controller, basic", {"navigate", at + "cell.swc", "--seconds", once, "--method", "basic"}},
      {"one cell, a picture of it (OpenGL)", {"render", at + "cell.swc", "-o", at + "cell.png"}, true},
      {"devices that are plugged in (libusb)", {"devices"}, true},
      {"a set of " + std::to_string(large), {"navigate", at + "large.fil", "--route", "random:1", "--seconds", once}},
      {"that set, 20 ms a tile, prefetch",
       {"navigate", at + "large.fil", "--route", "random:1", "--seconds", once, "--latency", "20"}},
      {"that set, real time", {"navigate", at + "large.fil", "--route", "random:1", "--seconds", "0.02", "--realtime"}},
      {"that set, nearest segment", {"nearest", at + "large.fil", "0", "700", "0"}},
      {"that set, samples alone (FLANN)", {"nearest", at + "large.fil", "0", "700", "0", "--approximate"}},
      {"that set, what it holds", {"info", at + "large.fil"}}};
  if (!options.scene.empty()) {
    cases.push_back({"the set given", {"navigate", options.scene, "--route", "random:1", "--seconds", once}});
    cases.push_back({"the set given, nearest segment", {"nearest", options.scene, "0", "700", "0"}});
    cases.push_back(
        {"the set given, samples alone (FLANN)", {"nearest", options.scene, "0", "700", "0", "--approximate"}});
  }

  BenchTable table{"start",
                   "From the start of the program to its end, one tick (20 in real time) or one query between: ms "
                   "(median, least), CPU ms, peak memory MiB, threads, files of the tile set that are open, libraries",
                   {"scene", "ms", "ms least", "cpu ms", "MiB", "threads", "set files", "libraries"},
                   {}};
  const int times = options.quick ? 2 : 20;
  Start cell;
  double cell_ms = 0;
  std::set<std::string> first_libraries;
  for (const Case& one : cases) {
    options.progress(one.name);
    std::vector<double> wall, cpu;
    Start sum;
    if (one.may_fail) {
      try {
        startOnce(one.arguments, false);
      } catch (const std::runtime_error& error) {
        report.notes.push_back(one.name + ": left out, " + error.what());
        continue;
      }
    }
    for (int i = 0; i < times; ++i) {
      const Start start = startOnce(one.arguments, false);
      wall.push_back(start.wall_ms), cpu.push_back(start.cpu_ms);
    }
    for (int i = 0; i < (options.quick ? 1 : 3); ++i) {  // watching from outside takes time, so these runs are extra
      Start start = startOnce(one.arguments, true);
      sum.threads = std::max(sum.threads, start.threads);
      sum.peak_mib = std::max(sum.peak_mib, start.peak_mib);
      sum.libraries.merge(start.libraries);
      sum.set_files.merge(start.set_files);
    }
    if (first_libraries.empty()) first_libraries = sum.libraries;
    std::set<std::string> more;
    std::set_difference(sum.libraries.begin(), sum.libraries.end(), first_libraries.begin(), first_libraries.end(),
                        std::inserter(more, more.begin()));
    report.samples.push_back({"start", {one.name}, "ms", "ms", false, wall});
    table.rows.push_back({one.name, percentile(wall, 0.5), percentile(wall, 0), percentile(cpu, 0.5), sum.peak_mib,
                          static_cast<std::int64_t>(sum.threads), static_cast<std::int64_t>(sum.set_files.size()),
                          &one == &cases.front() ? joined(sum.libraries)
                          : more.empty()         ? "no more"
                                                 : joined(more)});
    if (one.name == "one cell") {
      cell_ms = percentile(wall, 0.5);
      cell = sum;
    }
  }
  report.tables.push_back(std::move(table));
  const auto goal = [&](const std::string& what, const std::string& must, double measured, double most) {
    report.goals.push_back({what, must, "", measured, measured <= most, measured <= most});
  };
  goal("one cell, start to the end of the first tick, ms", "<= 20", cell_ms, 20);
  goal("one cell, peak memory, MiB", "<= 32", cell.peak_mib, 32);
  goal("one cell, threads beside the first", "0", static_cast<double>(std::max<std::size_t>(cell.threads, 1)) - 1, 0);
  goal("one cell, files of a tile set", "0", static_cast<double>(cell.set_files.size()), 0);
  report.notes.push_back("One cell: a synthetic neuron of " + std::to_string(one_cell.samples() - 1) + " segments.");
  report.notes.push_back(
      "Start to end is more than start to first tick: it includes leaving. FLANN is a header library, so no list of "
      "files shows it: its index is built by Nearest, at the first query of a set of more than 64 tiles; navigate asks "
      "no such query.");
  report.notes.push_back("Each start " + std::to_string(times) +
                         " times, files in the page cache; threads, files and memory as seen from outside every 0.2 ms "
                         "in three more: at least so much. The hand "
                         "is simulated; a device adds libusb's context.");
  return report;
}

}  // namespace

void addSceneWorkloads(std::vector<Workload>& all) {
  all.push_back({"scene", "what a scene costs from the program's start: time, memory, threads, libraries", runScene});
}

}  // namespace filiform::tools
