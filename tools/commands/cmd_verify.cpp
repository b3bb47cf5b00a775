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
#include <memory>
#include <optional>
#include <string>

#include <CLI/CLI.hpp>

namespace filiform::tools {

namespace {

struct VerifyArguments {
  std::string path;
  std::optional<std::string> sha256;
  bool deep = false;
  std::shared_ptr<const RemoteArguments> remote;
};

std::string checkedDigest(const std::string& text) {
  const std::string digest = lowerCase(text);
  if (digest.size() != 64 || digest.find_first_not_of("0123456789abcdef") != std::string::npos)
    throw UsageError("--sha256 " + escaped(text, 80) +
                     ": give 64 hexadecimal digits, as 'filiform info SET --sha256' prints them");
  return digest;
}

int runVerify(const VerifyArguments& a) {
  const std::string& path = a.path;
  std::unique_ptr<Progress> progress;
  std::string phase_now;
  VerifyOptions options;
  options.deep = a.deep;
  if (a.sha256) options.sha256 = checkedDigest(*a.sha256);
  options.remote = a.remote->options();
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
              << (a.deep ? ", every byte and every invariant of the format checked\n" : ", every byte checked\n");
    return 0;
  }
  for (const std::string& problem : report.problems) std::cout << problem << '\n';
  throw InputError(inShort(path) + ": damaged: " + counted(report.problem_count, "problem") +
                   (report.problem_count == 1 ? ": " : ", the first: ") + report.problems.front() +
                   "; run ingest again to make a new set");
}

}  // namespace

void addVerify(CLI::App& app, Chosen& chosen) {
  auto a = std::make_shared<VerifyArguments>();
  CLI::App* command = app.add_subcommand("verify", "Check every byte of a tile set");
  command->footer(
      "Example:\n  filiform verify --deep column.fil\nExits 1 and lists the problems if the set is damaged.");
  command->add_option("SET", a->path, "tile set, or its address")->required();
  command->add_flag("--deep", a->deep, "also check every invariant of the format");
  command->add_option("--sha256", a->sha256, "compare the SHA-256 of all bytes, which info --sha256 prints, with HEX")
      ->type_name("HEX");
  a->remote = addRemoteArguments(*command);
  addProgressOption(*command);
  command->callback([a, &chosen] { chosen = [a] { return runVerify(*a); }; });
}

}  // namespace filiform::tools
