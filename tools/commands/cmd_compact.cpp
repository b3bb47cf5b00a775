// filiform compact: rewrites a set to which cells were added, or from which cells were removed.
#include "index/errors.h"
#include "index/ingest/growth.h"
#include "index/text.h"
#include "tools/commands/commands.h"
#include "tools/commands/shared/growth_report.h"
#include "tools/commands/shared/remote_arguments.h"
#include "tools/program/interruption.h"
#include "tools/program/progress.h"
#include "tools/program/progress_option.h"
#include "tools/words/numbers.h"

#include <iostream>
#include <memory>

#include <CLI/CLI.hpp>

namespace filiform::tools {

namespace {

struct CompactArguments {
  std::string set, memory = "1GiB";
  unsigned threads = 0;
};

int runCompact(const CompactArguments& a) {
  refuseAddress("SET", a.set);
  IngestOptions options;
  options.threads = a.threads;
  options.cancel = &interruptFlag();
  options.memory = parseBytes("--memory", a.memory);
  if (options.memory < kMinIngestMemory)
    throw UsageError("--memory " + inShort(a.memory) + ": give at least " + formatBytes(kMinIngestMemory));
  std::unique_ptr<Progress> progress;
  std::string phase_now;
  options.progress = [&](const char* phase, std::uint64_t done, std::uint64_t total) {
    if (phase_now != phase) {
      phase_now = phase;
      progress = std::make_unique<Progress>(ProgressOptions{.title = phase, .noun = "", .total = total});
    }
    progress->setTotal(total);
    progress->update(done);
  };
  const GrowthResult result = compactSet(a.set, options);
  progress.reset();
  std::cout << reportOf(a.set, result.set);
  return 0;
}

}  // namespace

void addCompact(CLI::App& app, Chosen& chosen) {
  auto a = std::make_shared<CompactArguments>();
  CLI::App* command = app.add_subcommand("compact", "Rewrite a set that has grown, as if made at once");
  command->footer(
      "Example:\n  filiform compact column.fil\n"
      "ingest --add and --remove keep the older files of a set. compact writes one set of all cells and removes "
      "these.");
  command->add_option("SET", a->set, "tile set")->required();
  command
      ->add_option("--memory", a->memory, "use at most this memory and 32MiB; at least 64MiB (K, M, G: KiB, MiB, GiB)")
      ->capture_default_str()
      ->type_name("BYTES");
  command->add_option("--threads", a->threads, "use N threads; 0: one a core")->capture_default_str();
  addProgressOption(*command);
  command->callback([a, &chosen] { chosen = [a] { return runCompact(*a); }; });
}

}  // namespace filiform::tools
