// filiform synth: writes SWC of a synthetic column, of families of cells, or of a named test scene; or a circuit.
#include "index/errors.h"
#include "index/text.h"
#include "tools/commands/commands.h"
#include "tools/program/interruption.h"
#include "tools/program/output_check.h"
#include "tools/program/progress.h"
#include "tools/program/progress_option.h"
#include "tools/synthetic/synthetic.h"
#include "tools/synthetic/synthetic_circuit.h"
#include "tools/words/numbers.h"

#include <algorithm>
#include <filesystem>
#include <iostream>

#include <CLI/CLI.hpp>

namespace filiform::tools {

namespace {

// A regular file needs the ending .zip or none. A device or a pipe may have any name.
void checkArchiveName(const std::string& out) {
  const std::string ending = std::filesystem::path(out).extension().string();
  if (ending.empty() || endsWithNoCase(out, ".zip") || isStandardOutput(out) || !isFileOutput(out)) return;
  throw UsageError("--output " + inShort(out) + ": synth writes a zip archive of SWC files; give OUT.zip");
}

int runCircuit(const SyntheticOptions& options, const std::string& out) {
  if (out.empty()) throw UsageError("name the folder to fill: filiform synth DIR --format sonata");
  if (options.kind != "column" || !options.placements_out.empty())
    throw UsageError("--format sonata makes a column; leave out --kind and --placements-out");
  Progress progress({.title = "synth", .noun = "morphologies"});
  const SyntheticSummary summary = writeSyntheticCircuit(options, out, [&](std::uint64_t done, std::uint64_t total) {
    throwIfInterrupted();
    progress.setTotal(total);
    progress.update(done);
  });
  progress.finish();
  std::cout << escaped(out) << "/circuit_config.json: " << counted(summary.cells, "cell") << " from "
            << counted(summary.files, "morphology", "morphologies") << " of " << counted(summary.segments, "segment")
            << ", " << formatBytes(summary.zip_bytes) << " of H5\n";
  return 0;
}

int runSynth(const SyntheticOptions& options, const std::string& out) {
  if (out.empty()) throw UsageError("name the zip archive to write: filiform synth -o OUT.zip");
  checkArchiveName(out);
  checkOutputs({}, {{"--output", out}, {"--placements-out", options.placements_out}});
  std::ostream& people = isStandardOutput(out) || isStandardOutput(options.placements_out) ? std::cerr : std::cout;
  Progress progress({.title = "synth", .noun = "cells"});
  const SyntheticSummary summary = writeSynthetic(
      options, out,
      [&](std::uint64_t done, std::uint64_t total) {
        throwIfInterrupted();
        progress.setTotal(total);
        progress.update(done);
      },
      &interruptFlag());
  progress.finish();
  people << escaped(out) << ": " << counted(summary.files, "cell") << ", " << counted(summary.samples, "sample") << ", "
         << counted(summary.segments, "segment") << ", " << formatBytes(summary.text_bytes) << " of SWC in "
         << formatBytes(summary.zip_bytes) << " of zip\n";
  if (!options.placements_out.empty())
    people << escaped(options.placements_out) << ": places these morphologies " << counted(summary.cells, "time")
           << "\n";
  const auto isOneOf = [&](const std::vector<std::string>& kinds) {
    return std::find(kinds.begin(), kinds.end(), options.kind) != kinds.end();
  };
  if (isOneOf(sceneKinds()) || isOneOf(hardSceneKinds()))
    people << "suggested route through this scene: --route " << sceneRoute(options.kind) << '\n';
  return 0;
}

}  // namespace

void addSynth(CLI::App& app, Chosen& chosen) {
  auto options = std::make_shared<SyntheticOptions>();
  auto out = std::make_shared<std::string>();
  CLI::App* command =
      app.add_subcommand("synth", "Write a synthetic column as SWC or as a circuit, or a named test scene");
  command->footer(
      "Example:\n  filiform synth column.zip --cells 200 --seed 1\n  filiform synth scene2.zip --kind scene2\n"
      "  filiform synth circuit --format sonata --cells 100");
  command->add_option("OUT,-o,--output", *out, "write this zip archive, or this folder with --format sonata")
      ->type_name("OUT.zip|DIR");
  command->add_option("--cells", options->cells, "number of neurons or fans")->capture_default_str();
  command->add_option("--seed", options->seed, "random seed: the same seed gives the same bytes")
      ->capture_default_str();
  command->add_option("--kind", options->kind, "make " + kindList(syntheticKinds()))->capture_default_str();
  command
      ->add_option("--placements-out", options->placements_out,
                   "write a library of morphologies, and the table that places them to this file")
      ->type_name("TSV");
  command
      ->add_option("--library", options->library, "make at most N morphologies for --placements-out or --format sonata")
      ->type_name("N")
      ->capture_default_str();
  addProgressOption(*command);
  auto format = std::make_shared<std::string>("zip");
  command
      ->add_option("--format", *format,
                   "zip: an archive of SWC files; sonata: a folder with a circuit, its nodes and H5 morphologies")
      ->capture_default_str()
      ->check(CLI::IsMember({"zip", "sonata"}));
  command->callback([options, out, format, &chosen] {
    chosen = [options, out, format] {
      return *format == "sonata" ? runCircuit(*options, *out) : runSynth(*options, *out);
    };
  });
}

}  // namespace filiform::tools
