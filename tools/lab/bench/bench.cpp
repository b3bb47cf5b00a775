#include "tools/lab/bench/bench.h"

#include "tools/lab/bench/bench_record.h"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <malloc.h>
#include <sstream>
#include <stdexcept>
#include <sys/resource.h>
#include <sys/utsname.h>
#include <sys/wait.h>
#include <thread>
#include <unistd.h>

namespace filiform::tools {

namespace {

std::string processorName() {
  std::ifstream info("/proc/cpuinfo");
  for (std::string line; std::getline(info, line);)
    if (line.starts_with("model name")) {
      const std::size_t colon = line.find(':');
      if (colon != std::string::npos) return line.substr(std::min(line.size(), colon + 2));
    }
  return "unknown";
}

// Four significant digits.
std::string fourDigits(double value) {
  if (!std::isfinite(value)) return "-";
  std::ostringstream out;
  if (value != 0 && (std::abs(value) >= 1e7 || std::abs(value) < 1e-4)) {
    out.precision(3);
    out << std::scientific << value;
  } else if (std::abs(value) >= 1000) {
    out.precision(0);
    out << std::fixed << value;
  } else {
    out.precision(4);
    out << value;
  }
  return out.str();
}

}  // namespace

std::string shown(const BenchValue& value) {
  if (const auto* text = std::get_if<std::string>(&value)) return *text;
  if (const auto* count = std::get_if<std::int64_t>(&value)) return std::to_string(*count);
  return fourDigits(std::get<double>(value));
}

std::string BenchSample::name() const {
  std::string text = table;
  for (std::size_t i = 0; i < row.size(); ++i) text += (i == 0 ? ": " : ", ") + shown(row[i]);
  return text + ": " + column;
}

std::vector<std::pair<std::string, BenchValue>> machineFacts() {
  utsname system{};
  uname(&system);
  const auto pages = static_cast<std::int64_t>(sysconf(_SC_PHYS_PAGES));
  const auto page = static_cast<std::int64_t>(sysconf(_SC_PAGESIZE));
  return {{"processor", processorName()},
          {"threads", static_cast<std::int64_t>(std::thread::hardware_concurrency())},
          {"memory_bytes", pages * page},
          {"system", std::string(system.sysname) + " " + system.release},
          {"compiler", std::string("g++/clang " __VERSION__)},
          {"filiform", std::string(FILIFORM_VERSION)}};
}

std::string markdownTable(const BenchTable& table) {
  std::ostringstream out;
  out << table.caption << "\n\n|";
  for (const std::string& column : table.columns) out << ' ' << column << " |";
  out << "\n|";
  for (std::size_t i = 0; i < table.columns.size(); ++i) out << "---|";
  out << '\n';
  for (const auto& row : table.rows) {
    out << '|';
    for (const BenchValue& value : row) out << ' ' << shown(value) << " |";
    out << '\n';
  }
  return out.str();
}

BenchResult runWorkload(const Workload& workload, const BenchOptions& options) {
  const auto started = std::chrono::steady_clock::now();
  BenchResult result{workload.name, workload.summary, 0, workload.run(options)};
  result.wall_s = std::chrono::duration<double>(std::chrono::steady_clock::now() - started).count();
  const std::string base = options.out + "/" + workload.name;
  writeText(base + ".json", workloadJson(result, options));
  writeText(base + ".md", workloadMarkdown(result, options));
  return result;
}

WorkFolder::WorkFolder(const std::string& out, const std::string& name)
    : path_(out + "/" + name + ".tmp-" + std::to_string(::getpid())) {
  std::filesystem::remove_all(path_);
  std::filesystem::create_directories(path_);
}

WorkFolder::~WorkFolder() {
  std::error_code ignored;
  std::filesystem::remove_all(path_, ignored);
}

double percentile(std::vector<double> values, double fraction) {
  if (values.empty()) return std::nan("");
  const double rank = std::ceil(fraction * static_cast<double>(values.size()));
  const auto at = static_cast<std::size_t>(std::clamp(rank - 1.0, 0.0, static_cast<double>(values.size() - 1)));
  std::nth_element(values.begin(), values.begin() + static_cast<std::ptrdiff_t>(at), values.end());
  return values[at];
}

int ingestRuns(std::uint64_t segments, bool quick) { return quick ? 2 : segments <= 1'000'000 ? kBatches : 5; }

std::vector<double> batchMedians(const std::vector<double>& values) {
  std::vector<double> medians;
  const auto batches = std::min(values.size(), static_cast<std::size_t>(kBatches));
  for (std::size_t i = 0; i < batches; ++i) {
    const auto from = static_cast<std::ptrdiff_t>(values.size() * i / batches),
               to = static_cast<std::ptrdiff_t>(values.size() * (i + 1) / batches);
    medians.push_back(median({values.begin() + from, values.begin() + to}));
  }
  return medians;
}

ChildCost measureInChild(const std::function<std::vector<double>()>& work) {
  int ends[2];
  if (pipe(ends) != 0) throw std::runtime_error(std::string("pipe: ") + std::strerror(errno));
  malloc_trim(0);  // freed memory must not count for the child
  const auto started = std::chrono::steady_clock::now();
  const pid_t child = fork();
  if (child < 0) throw std::runtime_error(std::string("fork: ") + std::strerror(errno));
  if (child == 0) {
    close(ends[0]);
    std::string answer;
    try {
      for (const double number : work()) {
        char bytes[sizeof number];
        std::memcpy(bytes, &number, sizeof number);
        answer.append(bytes, sizeof bytes);
      }
      answer.insert(answer.begin(), 'n');
    } catch (const std::exception& error) {
      answer = std::string("e") + error.what();
    }
    for (std::size_t sent = 0; sent < answer.size();) {
      const ssize_t n = write(ends[1], answer.data() + sent, answer.size() - sent);
      if (n <= 0) break;
      sent += static_cast<std::size_t>(n);
    }
    _exit(0);
  }
  close(ends[1]);
  std::string answer;
  char buffer[4096];
  for (ssize_t n; (n = read(ends[0], buffer, sizeof buffer)) > 0;) answer.append(buffer, static_cast<std::size_t>(n));
  close(ends[0]);
  int status = 0;
  rusage usage{};
  wait4(child, &status, 0, &usage);
  ChildCost cost;
  cost.wall_s = std::chrono::duration<double>(std::chrono::steady_clock::now() - started).count();
  if (answer.empty() || answer[0] != 'n')
    throw std::runtime_error(answer.empty() ? "the measured process ended without a result" : answer.substr(1));
  const auto seconds = [](const timeval& t) {
    return static_cast<double>(t.tv_sec) + 1e-6 * static_cast<double>(t.tv_usec);
  };
  cost.cpu_s = seconds(usage.ru_utime) + seconds(usage.ru_stime);
  cost.peak_bytes = static_cast<std::uint64_t>(usage.ru_maxrss) * 1024;
  cost.numbers.resize((answer.size() - 1) / sizeof(double));
  if (!cost.numbers.empty()) std::memcpy(cost.numbers.data(), answer.data() + 1, cost.numbers.size() * sizeof(double));
  return cost;
}

}  // namespace filiform::tools
