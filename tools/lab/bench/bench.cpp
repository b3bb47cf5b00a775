#include "tools/lab/bench/bench.h"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstring>
#include <filesystem>
#include <malloc.h>
#include <stdexcept>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

namespace filiform::tools {

std::string BenchSample::name() const {
  std::string text = table;
  for (std::size_t i = 0; i < row.size(); ++i) text += (i == 0 ? ": " : ", ") + shown(row[i]);
  return text + ": " + column;
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
