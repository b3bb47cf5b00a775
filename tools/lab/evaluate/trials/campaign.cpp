#include "tools/lab/evaluate/trials/campaign.h"

#include "tools/lab/shared/parallel.h"
#include "tools/program/interruption.h"
#include "tools/words/numbers.h"

#include <atomic>
#include <map>
#include <memory>
#include <mutex>
#include <numeric>
#include <ostream>
#include <utility>

namespace filiform::tools {

namespace {

std::uint64_t tremorSeed(const DrawnRoute& route, std::uint64_t seed, std::uint32_t number) {
  return route.key ^ (seed * 0x9e3779b97f4a7c15u + number * 0xd1b54a32d192ed03u);
}

// Trial cells by treatment. Each is built when the first trial needs it.
class Treated {
 public:
  explicit Treated(const Cell& cell) : cell_(cell) {}
  TrialCell& operator()(const CellTreatment& treatment) {
    std::unique_ptr<TrialCell>& made = made_[treatment];
    if (!made) made = std::make_unique<TrialCell>(cell_, treatment);
    return *made;
  }
  const Route& route(const CellTreatment& treatment, const DrawnRoute& drawn) {
    const auto [at, fresh] = routes_.try_emplace({treatment, drawn.first, drawn.last});
    if (fresh) {
      const CellGraph& graph = (*this)(treatment).graph();
      at->second = std::make_unique<Route>(0, graph.grid, graph.positions, graph.parents, drawn.first, drawn.last);
    }
    return *at->second;
  }

 private:
  const Cell& cell_;
  std::map<CellTreatment, std::unique_ptr<TrialCell>> made_;
  std::map<std::tuple<CellTreatment, std::uint32_t, std::uint32_t>, std::unique_ptr<Route>> routes_;
};

std::vector<std::uint64_t> firstNumbers(const std::vector<CorpusCell>& cells) {
  std::vector<std::uint64_t> first(cells.size(), 0);
  for (std::size_t i = 1; i < cells.size(); ++i) first[i] = first[i - 1] + cells[i - 1].routes.size();
  return first;
}

void writeKeys(std::ostream& out, const std::vector<CorpusCell>& cells, const std::vector<Condition>& conditions,
               const TrialRow& row) {
  const Condition& condition = conditions[row.condition];
  const TrialSetup& setup = condition.setup;
  const CorpusCell& cell = cells[row.cell];
  const DrawnRoute& route = cell.routes[row.route];
  std::string source;  // quoted, because file names may hold any character
  for (const char c : cell.cell.source) source += c == '"' ? "\"\"" : std::string(1, c);
  out << condition.table << ',' << condition.variant << ',' << setup.method << ',' << setup.hand << ','
      << formatNumber(setup.stiffness_N_m) << ',' << formatNumber(setup.zoom_um) << ',' << '"' << source << '"' << ','
      << cell.held_out << ',' << cell.cell.sample_ids[route.first] << ',' << cell.cell.sample_ids[route.last] << ','
      << row.seed;
}

constexpr const char* kKeys =
    "table,variant,method,hand,stiffness_N_m,zoom_um,cell,held_out,first_sample,last_sample,seed";

}  // namespace

std::uint64_t countTrials(const std::vector<CorpusCell>& cells, const std::vector<Condition>& conditions) {
  std::uint64_t routes = 0, trials = 0;
  for (const CorpusCell& cell : cells) routes += cell.routes.size();
  for (const Condition& condition : conditions)
    trials += (routes + condition.one_in - 1) / condition.one_in * static_cast<std::uint64_t>(condition.seeds);
  return trials;
}

Campaign runCampaign(const std::vector<CorpusCell>& cells, const std::vector<Condition>& conditions,
                     const CampaignOptions& options) {
  Campaign campaign;
  VisitCounts none;
  none.fill(0);
  campaign.visits.assign(conditions.size(), {none, none});
  const std::vector<std::uint64_t> first_number = firstNumbers(cells);
  const std::uint64_t total = countTrials(cells, conditions);
  std::vector<std::vector<TrialRow>> rows(cells.size());
  std::atomic<std::uint64_t> done{0};
  std::mutex mutex;

  const auto travel = [&](std::size_t number) {
    const CorpusCell& cell = cells[number];
    Treated treated(cell.cell);
    std::map<std::uint32_t, VisitCounts> visits;
    for (std::uint32_t r = 0; r < cell.routes.size(); ++r) {
      const std::uint64_t route_number = first_number[number] + r;
      for (std::uint32_t c = 0; c < conditions.size(); ++c) {
        const Condition& condition = conditions[c];
        if (route_number % condition.one_in != 0) continue;
        TrialSetup setup = condition.setup;
        const bool timed = condition.time_one_in > 0 && route_number / condition.one_in % condition.time_one_in == 0;
        const Route& route = treated.route(setup.treatment, cell.routes[r]);
        for (std::uint32_t s = 0; s < static_cast<std::uint32_t>(condition.seeds); ++s) {
          throwIfInterrupted();
          setup.measure_time = timed && s < condition.timed_seeds;
          setup.seed = tremorSeed(cell.routes[r], options.seed, s);
          VisitCounts& counts = visits.try_emplace(c, none).first->second;
          rows[number].push_back(
              {c, static_cast<std::uint32_t>(number), r, s, runTrial(treated(setup.treatment), route, setup, &counts)});
          ++done;
        }
      }
    }
    const std::lock_guard lock(mutex);
    for (const auto& [c, counts] : visits) {
      VisitCounts& sum = campaign.visits[c][cell.held_out];
      for (std::size_t i = 0; i < sum.size(); ++i) sum[i] += counts[i];
    }
  };
  parallelFor(cells.size(), options.threads, travel, [&] {
    if (options.progress) options.progress(done.load(), total);
  });

  for (const std::vector<TrialRow>& some : rows) campaign.rows.insert(campaign.rows.end(), some.begin(), some.end());
  return campaign;
}

void writeTrialsHeader(std::ostream& out) {
  out << kKeys
      << ",rate_Hz,delay_samples,tremor_mm,lookahead_mm,aim_error_mm,max_visited,completed,out_of_time,route_um,"
         "reached_um,ticks,"
         "force_integral_Ns,mean_force_N,max_force_N,step_p999_N,step_max_N,jerks,jump_max_mm,off_um,skip_um,visited,"
         "visited_p99,visited_max,capped_ticks,stuck,stuck_inherent,last_stuck,last_inherent,last_climb_mm\n";
}

void writeTrials(std::ostream& out, const std::vector<CorpusCell>& cells, const std::vector<Condition>& conditions,
                 const Campaign& campaign) {
  for (const TrialRow& row : campaign.rows) {
    writeKeys(out, cells, conditions, row);
    const TrialSetup& setup = conditions[row.condition].setup;
    const TrialResult& r = row.result;
    for (const double value :
         {setup.rate_Hz, static_cast<double>(setup.delay_samples), 1e3 * setup.person.tremor_rms_m,
          1e3 * setup.person.lookahead_m, 1e3 * setup.person.aim_error_m, static_cast<double>(setup.max_visited)})
      out << ',' << formatNumber(value);
    out << ',' << r.completed << ',' << r.out_of_time;
    out << ',' << formatNumber(r.route_um) << ',' << formatNumber(r.reached_um) << ',' << r.ticks;
    for (const double value : {r.force_integral_Ns, r.mean_force_N, r.max_force_N, r.step_p999_N, r.step_max_N})
      out << ',' << formatNumber(value);
    out << ',' << r.jerks;
    for (const double value : {1e3 * r.jump_max_m, r.off_um, r.skip_um}) out << ',' << formatNumber(value);
    for (const std::uint64_t count : {r.visited, r.visited_p99, r.visited_max, r.capped_ticks, r.stuck,
                                      r.stuck_inherent, r.last_stuck, r.last_inherent})
      out << ',' << count;
    out << ',' << formatNumber(1e3 * r.last_climb_m) << '\n';
  }
}

void writeTimingsHeader(std::ostream& out) { out << kKeys << ",solver_ns\n"; }

void writeTimings(std::ostream& out, const std::vector<CorpusCell>& cells, const std::vector<Condition>& conditions,
                  const Campaign& campaign) {
  for (const TrialRow& row : campaign.rows) {
    if (row.result.solver_ns <= 0) continue;
    writeKeys(out, cells, conditions, row);
    out << ',' << formatNumber(row.result.solver_ns) << '\n';
  }
}

}  // namespace filiform::tools
