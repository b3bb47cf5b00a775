// Making: makes, grows or follows a tile set from files of neurons, with tables and circuits: what `filiform ingest`,
// filiform.ingest() of Python and filiform_ingest() of C do. They differ in their arguments and in how they report.
//
// Thread rule: one thread at a time; the functions of the caller are called on the calling thread.
#pragma once

#include "index/circuits/circuit.h"
#include "index/ingest/growth.h"
#include "index/ingest/ingest.h"
#include "index/input/input.h"

#include <functional>
#include <map>
#include <optional>
#include <string>
#include <vector>

namespace filiform::tools {

// A table: the path of a file, or its text.
struct MakingTable {
  std::string path{};                 // empty: none; with a text, its name in messages
  std::optional<std::string> text{};  // nullopt: read the file
};

struct MakingOrder {
  std::vector<std::string> inputs;
  std::string output;
  InputOptions reading{};  // all but memory, threads and cell_share
  CircuitOptions circuit{};
  MakingTable placements{}, attributes{};
  std::string key{};                  // the column of `attributes` with the names of cells
  bool add = false;                   // to an existing set
  bool sync = false;                  // the set follows its inputs
  bool remove_gone = false;           // with sync
  std::vector<std::string> remove{};  // only: removes the cells of these names
  // Called with what became of the inputs, before unusable ones end the work; with the fates if an existing set follows
  // its inputs. On rank 0 only.
  std::function<void(const std::vector<SourceReport>& reports, const std::map<std::string, SyncFate>* fates)> report{};
  std::function<void()> ended_reading{};  // after the last cell
};

struct MakingResult : SyncResult {
  std::vector<SourceReport> reports;  // on rank 0
  std::string text;                   // whole lines: inputs, populations and tables, for people
  std::vector<std::string> notes;     // doubts, a line each, for people
};

// Throws UsageError, with the names of options of the command line, for an order that contradicts itself.
void checkOrder(const MakingOrder& order, bool force);

// Makes the set. Of `options`, capacity, quantum_exponent, threads, memory, levels, force, cancel, progress and ranks
// count. Throws UsageError for circuits among several inputs; InputError if no input can be used, or with strict if one
// cannot; what ingest(), addCells(), removeCells() and syncCells() throw; exceptions of the caller's functions.
MakingResult make(MakingOrder order, IngestOptions options);

// The version that a word names: cng, source or both. Throws UsageError, which begins with `option`.
MorphologyVersion morphologyVersion(const std::string& word, const std::string& option);

// `given`, or one a core if it is 0.
unsigned threadsOr(unsigned given);

}  // namespace filiform::tools
