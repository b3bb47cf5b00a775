// Runs thousands of trials: every route of a set of cells under every condition, on several threads. The results depend
// on cells, conditions and seed, not on the threads. Thread rule: functions without state.
#pragma once

#include "tools/lab/evaluate/trials/trial.h"
#include "tools/lab/evaluate/trials/trial_corpus.h"

#include <array>
#include <cstdint>
#include <functional>
#include <iosfwd>
#include <string>
#include <vector>

namespace filiform::tools {

struct Condition {
  std::string table;               // the table of the report, a word
  std::string variant;             // the special parameter, for readers
  TrialSetup setup;                // its seed is not used
  int seeds = 1;                   // runs a route
  std::uint32_t one_in = 1;        // runs routes 0, one_in, 2 one_in ... in the order of cells and their routes
  std::uint32_t time_one_in = 0;   // times the solver on one in so many of the routes that it runs; 0: on none
  std::uint32_t timed_seeds = 20;  // number of seeds timed on these routes
};

struct TrialRow {
  std::uint32_t condition = 0, cell = 0, route = 0, seed = 0;  // positions in their lists
  TrialResult result;
};

struct Campaign {
  std::vector<TrialRow> rows;  // by cell, route, condition, seed
  // Number of ticks by segments tested, for each condition: [1] on held-out cells, [0] on the other cells.
  std::vector<std::array<VisitCounts, 2>> visits;
};

struct CampaignOptions {
  std::uint64_t seed = 1;  // of the tremor; the same for all conditions, so that routes can be compared one by one
  unsigned threads = 1;
  // Called about ten times a second on the caller's thread. An exception from it ends the campaign.
  std::function<void(std::uint64_t done, std::uint64_t total)> progress;
};

// The number of trials that runCampaign() would run.
std::uint64_t countTrials(const std::vector<CorpusCell>& cells, const std::vector<Condition>& conditions);

Campaign runCampaign(const std::vector<CorpusCell>& cells, const std::vector<Condition>& conditions,
                     const CampaignOptions& options);

// Writes a row a trial, with the fewest decimals that read back as the same double. The same campaign gives the same
// bytes.
void writeTrialsHeader(std::ostream& out);
void writeTrials(std::ostream& out, const std::vector<CorpusCell>& cells, const std::vector<Condition>& conditions,
                 const Campaign& campaign);
// Writes the time of a solver tick in the timed trials. These figures differ from run to run.
void writeTimingsHeader(std::ostream& out);
void writeTimings(std::ostream& out, const std::vector<CorpusCell>& cells, const std::vector<Condition>& conditions,
                  const Campaign& campaign);

}  // namespace filiform::tools
