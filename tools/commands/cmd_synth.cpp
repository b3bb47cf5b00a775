// filiform synth: SWC of a synthetic column, or of a named test scene.
#include "index/errors.h"
#include "index/text.h"
#include "tools/commands/commands.h"
#include "tools/program/interruption.h"
#include "tools/program/numbers.h"
#include "tools/program/output_check.h"
#include "tools/program/progress.h"
#include "tools/synthetic/synthetic.h"

#include <algorithm>
#include <iostream>

#include <CLI/CLI.hpp>

namespace filiform::tools {

namespace {

int runSynth(const SyntheticOptions& options, const std::string& out) {
  if (out.empty()) throw UsageError("name the zip archive to write: filiform synth -o OUT.zip");
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
  people << escaped(out) << ": " << formatCount(summary.files) << (summary.files == 1 ? " cell, " : " cells, ")
         << formatCount(summary.samples) << " samples, " << formatCount(summary.segments) << " segments, "
         << formatBytes(summary.text_bytes) << " of SWC in " << formatBytes(summary.zip_bytes) << " of zip\n";
  if (!options.placements_out.empty())
    people << escaped(options.placements_out) << ": places these morphologies " << formatCount(summary.cells)
           << " times\n";
  const auto& scenes = sceneKinds();
  if (std::find(scenes.begin(), scenes.end(), options.kind) != scenes.end())
    people << "the route meant for this scene: --route " << sceneRoute(options.kind) << '\n';
  return 0;
}

}  // namespace

void addSynth(CLI::App& app, Chosen& chosen) {
  auto options = std::make_shared<SyntheticOptions>();
  auto out = std::make_shared<std::string>();
  CLI::App* command = app.add_subcommand("synth", "Write SWC of a synthetic column, or of a named test scene");
  command->footer(
      "Example:\n  filiform synth column.zip --cells 200 --seed 1\n  filiform synth scene2.zip --kind scene2");
  command->add_option("OUT,-o,--output", *out, "zip archive to write")->type_name("OUT.zip");
  command->add_option("--cells", options->cells, "how many neurons or fans")->capture_default_str();
  command->add_option("--seed", options->seed, "the same seed gives the same bytes")->capture_default_str();
  command->add_option("--kind", options->kind, kindList(syntheticKinds()))->capture_default_str();
  command
      ->add_option("--placements-out", options->placements_out,
                   "write a library of morphologies, and to this file the table that places them")
      ->type_name("TSV");
  command->callback([options, out, &chosen] { chosen = [options, out] { return runSynth(*options, *out); }; });
}

}  // namespace filiform::tools
