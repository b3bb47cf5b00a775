// filiform check: reads SWC and zip as ingest would, and says what it would keep, drop and refuse.
#include "index/input.h"
#include "tools/cli.h"
#include "tools/progress.h"

#include <iostream>

#include <CLI/CLI.hpp>

namespace filiform::tools {

namespace {

struct CheckArguments {
  std::vector<std::string> inputs;
  bool tsv = false, strict = false;
};

int runCheck(const CheckArguments& a) {
  Progress progress({.title = "check", .noun = "", .unit = ProgressUnit::bytes});
  InputOptions options;
  options.swc.strict = a.strict;
  options.progress = [&](std::uint64_t done, std::uint64_t total) {
    throwIfInterrupted();
    progress.setTotal(total);
    progress.update(done);
  };
  Input input(a.inputs, options);
  for (Cell cell; input.next(cell);) {
  }
  progress.finish();
  if (a.tsv)
    writeCheckTable(std::cout, input.reports());
  else
    std::cout << summary(input.reports());
  if (const std::string doubt = input.unitDoubt(); !a.tsv && !doubt.empty())
    std::cerr << "filiform: note: " << doubt << '\n';
  return anyRefused(input.reports()) ? 1 : 0;
}

}  // namespace

void addCheck(CLI::App& app, Chosen& chosen) {
  auto arguments = std::make_shared<CheckArguments>();
  CLI::App* command = app.add_subcommand("check", "Read SWC and zip as ingest would, and report");
  command->footer("Example:\n  filiform check archive.zip more/ --tsv\nExits 1 if any input is refused.");
  command
      ->add_option("INPUT", arguments->inputs,
                   "SWC files, folders, zip archives; graphs: .edges, .obj, .vtk, skeletons")
      ->required();
  command->add_flag("--tsv", arguments->tsv, "one row an input: file severity samples segments dropped codes");
  command->add_flag("--strict", arguments->strict, "refuse every file with a warning");
  command->callback([arguments, &chosen] { chosen = [arguments] { return runCheck(*arguments); }; });
}

}  // namespace filiform::tools
