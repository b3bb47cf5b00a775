// Prints numbers that depend on every bit of the answers of a tile set: nearest segments, and a tour in virtual time.
// The same program runs on other processors and in node, so that they can be compared.
//
//   answers SET TICKS [times] [sse4]     the times too; without AVX2 and later
#include "index/query/nearest.h"
#include "index/set/tile_set.h"
#include "solver/travel/run/run.h"

#include <chrono>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <exception>
#include <hwy/targets.h>
#include <initializer_list>
#include <random>
#include <string>
#include <string_view>
#include <vector>

namespace {

using namespace filiform;

constexpr std::size_t kPoints = 10000;

class Digest {
 public:
  void mix(double value) {
    std::uint64_t bits;
    std::memcpy(&bits, &value, sizeof bits);
    mix(bits);
  }
  void mix(std::uint64_t bits) {
    value_ = (value_ ^ bits) * 0x9E3779B97F4A7C15;
    value_ ^= value_ >> 29;
  }
  unsigned long long value() const { return value_; }

 private:
  std::uint64_t value_ = 0;
};

double now_s() { return std::chrono::duration<double>(std::chrono::steady_clock::now().time_since_epoch()).count(); }

// Around the set's landmarks, at distances from 0.1 to 100 um. Not by a distribution of the standard library, which
// rounds as each library does.
std::vector<Vector3d> pointsOf(const TileStore& store) {
  std::mt19937_64 random(11);
  const Landmarks& landmarks = store.landmarks();
  std::vector<Vector3d> points;
  while (points.size() < kPoints && !landmarks.points.empty()) {
    Vector3d h_W = store.grid().toWorld(landmarks.points[random() % landmarks.points.size()]);
    const double size_um = 0.1 * static_cast<double>(1 << points.size() % 11);
    for (double& coordinate : h_W) coordinate += size_um * (static_cast<double>(random() >> 11) * 0x1p-52 - 1);
    points.push_back(h_W);
  }
  return points;
}

void printNearest(const TileStore& store, bool timed) {
  const std::vector<Vector3d> points = pointsOf(store);
  const Nearest nearest(store);
  for (const std::size_t k : {std::size_t{1}, std::size_t{5}}) {
    for (const char* const pass : {"first", "warm"}) {
      Digest digest;
      const double began_s = now_s();
      for (const Vector3d& h_W : points)
        for (const NearestResult& r : nearest.find(h_W, {.k = k})) {
          for (const double value : {r.distance_um, r.p_W.x(), r.p_W.y(), r.p_W.z(), r.t}) digest.mix(value);
          digest.mix(r.segment.key());
        }
      const double took_us = 1e6 * (now_s() - began_s) / static_cast<double>(points.size());
      std::printf("nearest k=%zu %016llx\n", k, digest.value());
      if (timed) std::printf("time nearest k=%zu %s %.2f us\n", k, pass, took_us);
    }
  }
}

void printTour(const TileStore& store, std::uint64_t ticks, bool timed) {
  for (const SolverMethod method : {SolverMethod::climb, SolverMethod::force, SolverMethod::shading}) {
    RunOptions options;
    options.method = method;
    options.route = routeChoiceOf("tour:3");
    options.seconds = static_cast<double>(ticks) * 1e-3;
    options.person.speed_m_s = 0.2;
    Digest digest;
    std::uint64_t rows = 0;
    const double began_s = now_s();
    const RunSummary summary = run(store, options, [&](const TickRow& row) {
      ++rows;
      for (const Vector3d& v : {row.p_W, row.h_W, row.force_N})
        for (const double value : v) digest.mix(value);
    });
    std::printf("navigate %s %llu ticks %016llx\n", toString(method), static_cast<unsigned long long>(rows),
                digest.value());
    if (timed)
      std::printf("time navigate %s %.2f us a tick\n", toString(method),
                  1e6 * (now_s() - began_s) / static_cast<double>(rows));
    if (summary.outcome != RunOutcome::completed)
      std::fprintf(stderr, "answers: %s ended as %s\n", toString(method), toString(summary.outcome));
  }
}

}  // namespace

int main(int count, char** words) {
  if (count < 3) {
    std::fprintf(stderr, "answers SET TICKS [times] [sse4]\n");
    return 2;
  }
  try {
    bool timed = false;
    for (int i = 3; i < count; ++i) {
      const std::string_view word = words[i];
      timed |= word == "times";
#ifdef __x86_64__
      if (word == "sse4") hwy::DisableTargets(HWY_AVX2 | HWY_AVX3 | HWY_AVX3_DL);
#endif
    }
    const auto set = TileSet::open(words[1]);
    printNearest(*set, timed);
    printTour(*set, std::strtoull(words[2], nullptr, 10), timed);
  } catch (const std::exception& error) {
    std::fprintf(stderr, "answers: %s\n", error.what());
    return 1;
  }
}
