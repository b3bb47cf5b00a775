// Trials in their thousands: every route of a set of cells under every condition, on several threads. What comes out
// depends on cells, conditions and seed, not on the threads. Thread rule: functions without state.
#pragma once

#include "tools/lab/evaluate/trial.h"
#include "tools/lab/evaluate/trial_corpus.h"

#include <array>
#include <cstdint>
#include <functional>
#include <iosfwd>
#include <string>
#include <vector>

namespace filiform::tools {

struct Condition {
  std::string table;               // a word: what it belongs to
  std::string variant;             // what is special about it, for people
  TrialSetup setup;                // its seed is not used
  int seeds = 1;                   // runs a route
  std::uint32_t one_in = 1;        // runs routes number 0, one_in, 2 one_in .. in the order of cells and their routes
  std::uint32_t time_one_in = 0;   // of the routes that it runs, the solver is timed on one in so many; 0: on none
  std::uint32_t timed_seeds = 20;  // of these routes, with so many first seeds
};

struct TrialRow {
  std::uint32_t condition = 0, cell = 0, route = 0, seed = 0;  // positions in their lists
  TrialResult result;
};

struct Campaign {
  std::vector<TrialRow> rows;  // by cell, route, condition, seed
  // Ticks by segments tested: of each condition, [1] on held-out cells, [0] on the others.
  std::vector<std::array<VisitCounts, 2>> visits;
};

struct CampaignOptions {
  std::uint64_t seed = 1;  // of the tremor; the same for all conditions, so that they can be compared route by route
  unsigned threads = 1;
  // Called about ten times a second on the caller's thread. What it throws ends the campaign.
  std::function<void(std::uint64_t done, std::uint64_t total)> progress;
};

// How many trials that will be.
std::uint64_t countTrials(const std::vector<CorpusCell>& cells, const std::vector<Condition>& conditions);

Campaign runCampaign(const std::vector<CorpusCell>& cells, const std::vector<Condition>& conditions,
                     const CampaignOptions& options);

// A row a trial, shortest decimals that read back to the same double; the same bytes for the same campaign.
void writeTrialsHeader(std::ostream& out);
void writeTrials(std::ostream& out, const std::vector<CorpusCell>& cells, const std::vector<Condition>& conditions,
                 const Campaign& campaign);
// What differs from run to run: the time that a tick of the solver takes, of the trials that were timed.
void writeTimingsHeader(std::ostream& out);
void writeTimings(std::ostream& out, const std::vector<CorpusCell>& cells, const std::vector<Condition>& conditions,
                  const Campaign& campaign);

}  // namespace filiform::tools
