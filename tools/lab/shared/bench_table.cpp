#include "tools/lab/shared/bench_table.h"

#include <algorithm>
#include <cmath>
#include <fstream>
#include <sstream>
#include <sys/utsname.h>
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

double percentile(std::vector<double> values, double fraction) {
  if (values.empty()) return std::nan("");
  const double rank = std::ceil(fraction * static_cast<double>(values.size()));
  const auto at = static_cast<std::size_t>(std::clamp(rank - 1.0, 0.0, static_cast<double>(values.size() - 1)));
  std::nth_element(values.begin(), values.begin() + static_cast<std::ptrdiff_t>(at), values.end());
  return values[at];
}

}  // namespace filiform::tools
