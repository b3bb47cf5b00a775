// filiform verify: checks a tile set for damage.
#include "index/errors.h"
#include "index/text.h"
#include "index/verify/verify.h"
#include "tools/commands/commands.h"
#include "tools/commands/shared/remote_arguments.h"
#include "tools/program/interruption.h"
#include "tools/program/progress.h"
#include "tools/program/progress_option.h"
#include "tools/words/numbers.h"

#include <iostream>

#include <CLI/CLI.hpp>

namespace filiform::tools {

namespace {

int runVerify(const std::string& path, bool deep, const RemoteArguments& remote) {
  std::unique_ptr<Progress> progress;
  std::string phase_now;
  VerifyOptions options;
  options.deep = deep;
  options.remote = remote.options();
  options.cancel = &interruptFlag();
  options.progress = [&](const char* phase, std::uint64_t done, std::uint64_t total) {
    if (phase_now != phase) {
      phase_now = phase;
      progress = std::make_unique<Progress>(ProgressOptions{.title = phase, .noun = "", .total = total});
    }
    progress->update(done);
  };
  const VerifyReport report = verify(path, options);
  progress.reset();
  if (report.sound()) {
    std::cout << escaped(path) << ": sound: " << counted(report.tiles, "tile") << ", " << formatBytes(report.bytes)
              << (deep ? ", every byte and every invariant of the format checked\n" : ", every byte checked\n");
    return 0;
  }
  for (const std::string& problem : report.problems) std::cout << problem << '\n';
  throw InputError(inShort(path) + ": damaged: " + counted(report.problem_count, "problem") +
                   (report.problem_count == 1 ? ": " : ", the first: ") + report.problems.front() +
                   "; run ingest again to make a new set");
}

}  // namespace

void addVerify(CLI::App& app, Chosen& chosen) {
  auto path = std::make_shared<std::string>();
  auto deep = std::make_shared<bool>(false);
  CLI::App* command = app.add_subcommand("verify", "Check every byte of a tile set");
  command->footer(
      "Example:\n  filiform verify --deep column.fil\nExits 1 and lists the problems if the set is damaged.");
  command->add_option("SET", *path, "tile set, or its address")->required();
  command->add_flag("--deep", *deep, "also check every invariant of the format");
  const std::shared_ptr<const RemoteArguments> remote = addRemoteArguments(*command);
  addProgressOption(*command);
  command->callback(
      [path, deep, remote, &chosen] { chosen = [path, deep, remote] { return runVerify(*path, *deep, *remote); }; });
}

}  // namespace filiform::tools
