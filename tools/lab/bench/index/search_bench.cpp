// bench search: what approximate results save, and how wrong they are: epsilon, landmarks alone, resident tiles only;
// and single precision.
#include "index/geometry/partition.h"
#include "index/ingest/memory_tiles.h"
#include "index/ingest/tiling/landmarks.h"
#include "index/query/nearest.h"
#include "tools/lab/bench/index/dense_cells.h"
#include "tools/lab/bench/knee.h"
#include "tools/lab/bench/trade.h"
#include "tools/lab/bench/workloads.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <memory>
#include <random>

#include <flann/flann.hpp>

namespace filiform::tools {

namespace {

struct SearchScene {
  std::unique_ptr<TileStore> store;
  std::vector<Vector3d> points;
  std::vector<NearestResult> truth;  // the exact result of each point
};

// CPU time of a point, ns, by batch.
template <typename Work>
std::vector<double> timed(std::size_t points, Work&& work) {
  std::vector<double> ns;
  for (int batch = 0; batch < kBatches; ++batch) {
    const double from = threadTime_s();
    for (std::size_t i = 0; i < points; ++i) work(i);
    ns.push_back(1e9 * (threadTime_s() - from) / static_cast<double>(points));
  }
  return ns;
}

void measureEpsilon(const BenchOptions& options, const SearchScene& scene, BenchReport& report) {
  BenchTable table{"epsilon",
                   "Nearest within a factor 1 + epsilon, warm, uniform points: ns of CPU, tiles searched, how much "
                   "farther than the nearest (parts of its distance), how often the nearest",
                   {"epsilon", "ns", "tiles", "error mean", "error most", "recall"},
                   {}};
  PlotSeries time{"CPU a query", {}, {}}, tiles{"tiles a query", {}, {}};
  const Nearest nearest(*scene.store, {.budget_bytes = UINT64_MAX});
  std::vector<NearestResult> results;
  for (const double epsilon : {0.0, 0.02, 0.05, 0.1, 0.2, 0.5, 1.0, 2.0}) {
    options.progress("epsilon " + shown(epsilon));
    double searched = 0, sum = 0, most = 0;
    std::size_t same = 0;
    for (std::size_t i = 0; i < scene.points.size(); ++i) {
      searched += nearest.find(scene.points[i], {.epsilon = epsilon}, results).tiles_searched;
      const NearestResult& found = results.at(0);
      const double true_um = scene.truth[i].distance_um;
      const double error = true_um > 0 ? found.distance_um / true_um - 1 : found.distance_um > 0 ? INFINITY : 0;
      sum += error, most = std::max(most, error);
      same += found.segment == scene.truth[i].segment;
    }
    const auto n = static_cast<double>(scene.points.size());
    const std::vector<double> ns =
        timed(scene.points.size(), [&](std::size_t i) { nearest.find(scene.points[i], {.epsilon = epsilon}); });
    report.samples.push_back({table.name, {epsilon}, "ns", "ns", false, ns});
    table.rows.push_back({epsilon, median(ns), searched / n, sum / n, most, static_cast<double>(same) / n});
    report.bounds.push_back({"nearest, epsilon " + shown(epsilon), "at most 1 + epsilon times too far (nearest.h)",
                             epsilon + 1e-12, most, "of the distance"});
    time.x.push_back(epsilon), time.y.push_back(median(ns));
    tiles.x.push_back(epsilon), tiles.y.push_back(searched / n);
  }
  BenchCurve curve = tradeCurve("epsilon", "Nearest segment: time against the error that is allowed",
                                "epsilon (parts of the distance)", "CPU a query (ns)", {time}, false, false);
  addLine(curve, 0, "exact, default");
  const std::string knee = lineAtKnee(curve);
  curve.finding = "Exact takes " + shown(time.y.front()) + " ns and " + shown(tiles.y.front()) +
                  " tiles, epsilon 2 takes " + shown(time.y.back()) + " ns and " + shown(tiles.y.back()) + " tiles (" +
                  knee + "); a jump asks once. The default stays exact.";
  report.curves.push_back(std::move(curve));
  report.tables.push_back(std::move(table));
}

// The landmarks alone, for several numbers of them, searched by FLANN with its own eps.
void measureSamples(const BenchOptions& options, const SearchScene& scene, std::uint64_t segments,
                    BenchReport& report) {
  BenchTable table{
      "samples",
      "Nearest from samples alone: points, covering radius R (um), bytes, FLANN's eps, ns of CPU, how much "
      "farther than the nearest segment (um), and the bound sqrt(1 + eps) (d + R) - d at its tightest",
      {"samples", "R_um", "bytes", "eps", "ns", "error mean um", "error p99 um", "error most um", "most over bound"},
      {},
      {"samples", "eps"}};
  PlotSeries error{"error, eps 0", {}, {}}, radius{"covering radius R", {}, {}};
  const std::size_t standard = landmarksFor(segments);
  std::vector<std::size_t> counts;
  for (std::size_t n = options.quick ? 256 : 1024; n <= (options.quick ? 1024 : kMaxLandmarks); n *= 2)
    counts.push_back(n);
  if (std::find(counts.begin(), counts.end(), standard) == counts.end()) counts.push_back(standard);
  std::sort(counts.begin(), counts.end());
  PlotSeries time{"CPU a query", {}, {}};
  double worst = 0;
  PlotSeries eps_time{"CPU a query", {}, {}};
  double eps_error = 0, exact_error = 0;
  for (const std::size_t count : counts) {
    options.progress(std::to_string(count) + " samples");
    const Landmarks samples = chooseLandmarks(*scene.store, count);
    std::vector<double> flat;
    for (const GridPoint& p : samples.points) {
      const Vector3d p_W = scene.store->grid().toWorld(p);
      flat.insert(flat.end(), {p_W.x(), p_W.y(), p_W.z()});
    }
    flann::Index<flann::L2_Simple<double>> index(flann::Matrix<double>(flat.data(), samples.points.size(), 3),
                                                 flann::KDTreeSingleIndexParams(10));
    index.buildIndex();
    for (const double eps : {0.0, 0.1, 0.5, 1.0, 3.0}) {
      if (eps > 0 && count != standard) continue;
      flann::SearchParams search(flann::FLANN_CHECKS_UNLIMITED);
      search.eps = static_cast<float>(eps);
      std::vector<double> found(scene.points.size());
      const std::vector<double> ns = timed(scene.points.size(), [&](std::size_t i) {
        Vector3d h_W = scene.points[i];
        int which = 0;
        double squared = 0;
        flann::Matrix<int> indices(&which, 1, 1);
        flann::Matrix<double> distances(&squared, 1, 1);
        index.knnSearch(flann::Matrix<double>(h_W.data(), 1, 3), indices, distances, 1, search);
        found[i] = std::sqrt(squared);
      });
      std::vector<double> errors;
      double sum = 0, over = -INFINITY;
      for (std::size_t i = 0; i < found.size(); ++i) {
        const double d = scene.truth[i].distance_um;
        errors.push_back(found[i] - d);
        sum += errors.back();
        over = std::max(over, found[i] - std::sqrt(1 + eps) * (d + samples.covering_radius_um));
      }
      worst = std::max(worst, over);
      const double p99 = percentile(errors, 0.99), most = percentile(errors, 1);
      table.rows.push_back({static_cast<std::int64_t>(samples.points.size()), samples.covering_radius_um,
                            static_cast<std::int64_t>(samples.points.size() * 40), eps, median(ns),
                            sum / static_cast<double>(found.size()), p99, most, over});
      if (eps == 0) {
        const auto n = static_cast<double>(samples.points.size());
        error.x.push_back(n), error.y.push_back(most);
        radius.x.push_back(n), radius.y.push_back(samples.covering_radius_um);
        time.x.push_back(n), time.y.push_back(median(ns));
        report.bounds.push_back({"approximate, " + std::to_string(samples.points.size()) + " samples",
                                 "off by the covering radius at most (nearest.h)", samples.covering_radius_um, most,
                                 "um"});
        if (count == standard) exact_error = p99;
      }
      if (count == standard) {
        eps_time.x.push_back(eps), eps_time.y.push_back(median(ns));
        eps_error = p99;
      }
    }
  }
  report.bounds.push_back({"samples through FLANN's eps", "sqrt(1 + eps) (d + R), the worst excess over it", 1e-9,
                           std::max(worst, 0.0), "um"});
  BenchCurve curve = tradeCurve("samples", "Samples alone: error against their number", "samples",
                                "farther than the nearest (um)", {error, radius}, true, true);
  addLine(curve, static_cast<double>(standard), "default");
  const std::string knee = lineAtKnee(curve);
  curve.finding = "The largest error falls as the number to the power of " + shown(logSlope(error.x, error.y)) + " (" +
                  knee + "), and the query grows from " + shown(time.y.front()) + " to " + shown(time.y.back()) +
                  " ns. The default, one for 128 segments, serves exact search as a hint: a bound, not an answer.";
  report.curves.push_back(std::move(curve));
  BenchCurve eps_curve = tradeCurve("flann_eps", "FLANN's eps: time of a query of the samples", "FLANN eps",
                                    "CPU a query (ns)", {eps_time}, false, false);
  addLine(eps_curve, 0, "exact, default");
  const std::string eps_knee = lineAtKnee(eps_curve);
  eps_curve.finding = "eps 3 saves " + shown(eps_time.y.front() - eps_time.y.back()) + " ns of " +
                      shown(eps_time.y.front()) + " and moves the 99th percentile of the error from " +
                      shown(exact_error) + " to " + shown(eps_error) + " um (" + eps_knee + "). The default stays 0.";
  report.curves.push_back(std::move(eps_curve));
  report.tables.push_back(std::move(table));
}

void measureResident(const BenchOptions& options, const SearchScene& scene, BenchReport& report) {
  BenchTable table{
      "resident",
      "Nearest among tiles in memory only, uniform points, after as many queries elsewhere: budget in parts "
      "of the whole, answers, how often the nearest, how much farther (um), how often it was said to be "
      "exact, and wrongly so",
      {"budget", "resident", "answers", "recall", "error mean um", "error p99 um", "ns", "said exact", "wrongly"},
      {}};
  double whole = 0;
  for (TileId id = 0; id < scene.store->tile_count(); ++id)
    whole += static_cast<double>(scene.store->entry(id).decoded_bytes);
  PlotSeries recall{"the nearest was found", {}, {}};
  double wrongly_said = 0;
  for (const double part : {0.02, 0.05, 0.1, 0.2, 0.4, 0.7, 1.0, 2.0}) {
    options.progress("resident only, budget " + shown(part));
    const Nearest nearest(*scene.store, {.budget_bytes = static_cast<std::uint64_t>(part * whole)});
    // In an order other than that of the tiles.
    for (std::size_t i = 0; i < scene.points.size(); ++i) nearest.find(scene.points[i]);
    std::vector<double> errors;
    double answers = 0, same = 0, sum = 0, exact = 0, wrongly = 0;
    for (std::size_t i = 0; i < scene.points.size(); ++i) {
      const auto found = nearest.find(scene.points[i], {.resident_only = true});
      if (found.empty()) continue;
      ++answers;
      const double error = found[0].distance_um - scene.truth[i].distance_um;
      same += found[0].segment == scene.truth[i].segment;
      errors.push_back(error);
      sum += error;
      exact += found[0].exact;
      wrongly += found[0].exact && error > 1e-9;
    }
    const auto n = static_cast<double>(scene.points.size());
    const std::vector<double> ns =
        timed(scene.points.size(), [&](std::size_t i) { nearest.find(scene.points[i], {.resident_only = true}); });
    table.rows.push_back({part, static_cast<double>(nearest.bytes()) / whole, answers / n, same / n,
                          answers > 0 ? sum / answers : 0.0, percentile(errors, 0.99), median(ns), exact / n,
                          static_cast<std::int64_t>(wrongly)});
    recall.x.push_back(part), recall.y.push_back(1 - same / n);
    wrongly_said += wrongly;
  }
  report.bounds.push_back({"resident only", "what is said to be exact is (nearest.h); wrong answers among those", 0,
                           wrongly_said, "answers"});
  BenchCurve curve =
      tradeCurve("resident", "Only what is in memory: how often the nearest segment is missed",
                 "budget (parts of all tiles and their trees)", "nearest missed (parts of all)", {recall}, true, false);
  const auto complete = std::find(recall.y.begin(), recall.y.end(), 0.0);
  if (complete != recall.y.end())
    addLine(curve, recall.x[static_cast<std::size_t>(complete - recall.y.begin())], "exact");
  const std::string knee = lineAtKnee(curve);
  curve.finding = "Off by default: it trades completeness for never waiting, for callers that must not; missed are " +
                  shown(100 * recall.y.front()) + " % at a budget of 2 % and " + shown(100 * recall.y.back()) +
                  " % with everything in memory (" + knee + "). Its answers say whether they are exact.";
  report.curves.push_back(std::move(curve));
  report.tables.push_back(std::move(table));
}

template <typename Real>
Real distanceTo(const std::array<Real, 9>& s) {  // h, a, b
  Real ab[3], ah[3], dot = 0, square = 0;
  for (std::size_t k = 0; k < 3; ++k) {
    ab[k] = s[6 + k] - s[3 + k], ah[k] = s[k] - s[3 + k];
    dot += ab[k] * ah[k], square += ab[k] * ab[k];
  }
  const Real t = square > 0 ? std::clamp(dot / square, Real(0), Real(1)) : Real(0);
  Real sum = 0;
  for (std::size_t k = 0; k < 3; ++k) {
    const Real d = ah[k] - t * ab[k];
    sum += d * d;
  }
  return std::sqrt(sum);
}

// The product has no single-precision path. This measures what one would gain and lose.
void measurePrecision(const BenchOptions& options, BenchReport& report) {
  options.progress("float and double");
  BenchTable table{"precision",
                   "Distance to a segment of 2 um, 1 um away, in float and in double, at a distance from the origin: "
                   "largest error (nm), ns",
                   {"from origin um", "float error nm", "double error nm", "float ns", "double ns"},
                   {}};
  PlotSeries single{"float", {}, {}}, twofold{"double", {}, {}}, step{"half a quantum of the grid", {}, {}};
  std::mt19937_64 random(options.seed);
  std::uniform_real_distribution<double> unit(-1, 1);
  const std::size_t count = options.quick ? 1000 : 20000;
  double last_ratio = 1;
  for (double far_um = 1; far_um < 2e9; far_um *= 10) {
    std::vector<std::array<double, 9>> exact(count);
    std::vector<std::array<float, 9>> rounded(count);
    double worst_float = 0, worst_double = 0;
    for (std::size_t i = 0; i < count; ++i) {
      // On a grid of 2^-9 um, which doubles and long doubles represent exactly at these distances.
      std::array<long double, 9> wide{};
      for (std::size_t k = 0; k < 9; ++k) {
        const double near_um = (k < 3 ? 1.0 : 0.6) * unit(random);
        wide[k] = std::round(512 * (far_um + near_um)) / 512;
        exact[i][k] = static_cast<double>(wide[k]);
        rounded[i][k] = static_cast<float>(wide[k]);
      }
      const long double truth = distanceTo(wide);
      worst_float = std::max(worst_float, std::abs(static_cast<double>(distanceTo(rounded[i]) - truth)));
      worst_double = std::max(worst_double, static_cast<double>(std::abs(distanceTo(exact[i]) - truth)));
    }
    double sum = 0;
    const auto cost = [&](const auto& all) {
      std::vector<double> ns;
      for (int batch = 0; batch < kBatches; ++batch) {
        const double from = threadTime_s();
        for (const auto& one : all) sum += static_cast<double>(distanceTo(one));
        ns.push_back(1e9 * (threadTime_s() - from) / static_cast<double>(count));
      }
      return median(ns);
    };
    const double float_ns = cost(rounded), double_ns = cost(exact);
    if (!(sum >= 0)) throw std::logic_error("distances are not numbers");
    last_ratio = double_ns / float_ns;
    table.rows.push_back({far_um, 1e3 * worst_float, 1e3 * worst_double, float_ns, double_ns});
    single.x.push_back(far_um), single.y.push_back(1e3 * worst_float);
    twofold.x.push_back(far_um), twofold.y.push_back(1e3 * worst_double);
    step.x.push_back(far_um), step.y.push_back(1e3 / 1024);
  }
  BenchCurve curve =
      tradeCurve("precision", "Float against double: error of a distance, by the distance from the origin",
                 "from the origin (um)", "largest error (nm)", {single, twofold, step}, true, true);
  const auto coarse = std::find_if(single.y.begin(), single.y.end(), [&](double nm) { return nm > step.y[0]; });
  const std::size_t at = static_cast<std::size_t>(coarse - single.y.begin());
  if (at < single.x.size()) addLine(curve, single.x[at], "float is worse than the grid: the knee");
  curve.plot.series[1].name += " (default)";
  curve.finding = "Double takes " + shown(last_ratio) + " times the time of float, and its largest error is " +
                  shown(*std::max_element(twofold.y.begin(), twofold.y.end())) +
                  " nm; float is off by more than half a "
                  "quantum from " +
                  shown(at < single.x.size() ? single.x[at] : INFINITY) +
                  " um from the origin on. Only double is built: positions are integers of the grid, exact in double; "
                  "boxes of the search tree are rounded outwards.";
  report.curves.push_back(std::move(curve));
  report.tables.push_back(std::move(table));
}

BenchReport runSearch(const BenchOptions& options) {
  BenchReport report;
  const std::uint64_t segments = options.quick ? 20'000 : options.segments != 0 ? options.segments : 1'000'000;
  const std::vector<Cell> library = morphologyLibrary(options.corpus, options.quick ? 4 : 60, options.seed);
  options.progress("tiles of " + std::to_string(segments) + " segments");
  DenseCells cells(library, segments, kPerUm3, options.seed);
  SearchScene scene{buildTilesInMemory(cells), {}, {}};
  std::mt19937_64 random(options.seed);
  std::uniform_real_distribution<double> place(0, cells.side_um());
  const Nearest exact(*scene.store, {.budget_bytes = UINT64_MAX});
  for (std::size_t i = 0; i < (options.quick ? 50u : 2000u); ++i) {
    scene.points.emplace_back(place(random), place(random), place(random));
    scene.truth.push_back(exact.find(scene.points.back()).at(0));
  }
  measureEpsilon(options, scene, report);
  measureSamples(options, scene, segments, report);
  measureResident(options, scene, report);
  measurePrecision(options, report);
  report.versions.emplace_back("FLANN", FLANN_VERSION_);
  report.notes.push_back(std::to_string(segments) + " segments at 0.67 a um^3, " +
                         std::to_string(scene.store->tile_count()) + " tiles in memory, " +
                         std::to_string(scene.points.size()) + " uniform points; medians of " +
                         std::to_string(kBatches) + " batches, processor time of the thread.");
  return report;
}

}  // namespace

void addSearchWorkloads(std::vector<Workload>& all) {
  all.push_back({"search", "nearest segments that may be wrong: epsilon, samples, resident only, float", runSearch});
}

}  // namespace filiform::tools
