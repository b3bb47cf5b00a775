// filiform tidy: removes what older pushes left of a set in an object store.
#include "index/stores/set_tidy.h"
#include "index/text.h"
#include "tools/commands/commands.h"
#include "tools/program/interruption.h"
#include "tools/program/progress.h"
#include "tools/program/progress_option.h"
#include "tools/words/numbers.h"

#include <array>
#include <cmath>
#include <iostream>
#include <memory>

#include <CLI/CLI.hpp>
#include <nlohmann/json.hpp>

namespace filiform::tools {

namespace {

using Kept = StoredRevision::Kept;

struct TidyArguments {
  std::string address;
  double days = 7;
  bool yes = false, json = false;
};

const char* wordOf(Kept kept) {
  static constexpr std::array<const char*, 4> kWords{"old", "current", "in use", "young"};
  return kWords.at(static_cast<std::size_t>(kept));
}

double daysOf(const StoredRevision& revision) { return revision.age_s / 86'400; }

void printTidyJson(const TidyArguments& a, const TidyResult& result) {
  nlohmann::ordered_json revisions = nlohmann::ordered_json::array();
  for (const StoredRevision& r : result.revisions)
    revisions.push_back({{"name", r.name},
                         {"objects", r.objects},
                         {"uploads", r.uploads},
                         {"bytes", r.bytes},
                         {"age_days", daysOf(r)},
                         {"state", wordOf(r.kept)},
                         {"removed", a.yes && r.kept == Kept::no}});
  std::cout << nlohmann::ordered_json{{"revisions", revisions},
                                      {"removed_objects", result.removed},
                                      {"requests", result.counters.requests}}
                   .dump()
            << '\n';
}

void printTidied(const TidyArguments& a, const TidyResult& result) {
  StoredRevision sum;
  std::uint64_t old = 0;
  for (const StoredRevision& r : result.revisions) {
    std::cout << r.name << '\t' << counted(r.objects, "object");
    if (r.uploads != 0) std::cout << " and " << counted(r.uploads, "unfinished upload");
    std::cout << '\t' << formatBytes(r.bytes) << '\t' << formatNumber(std::round(daysOf(r) * 10) / 10) << " days\t"
              << wordOf(r.kept) << '\n';
    if (r.kept != Kept::no) continue;
    ++old;
    sum.objects += r.objects;
    sum.uploads += r.uploads;
    sum.bytes += r.bytes;
  }
  std::cout << escaped(a.address) << ": ";
  if (old == 0) {
    std::cout << "nothing to remove: no revision is out of use and older than " << formatNumber(a.days) << " days\n";
    return;
  }
  std::cout << (a.yes ? "removed " : "to remove: ") << counted(old, "revision") << ", "
            << counted(sum.objects, "object");
  if (sum.uploads != 0) std::cout << ", " << counted(sum.uploads, "unfinished upload");
  std::cout << ", " << formatBytes(sum.bytes) << (a.yes ? "\n" : "; add --yes to remove\n");
}

int runTidy(const TidyArguments& a) {
  Progress progress({.title = "tidy", .noun = "object"});
  TidyOptions options{.older_than_days = a.days, .remove = a.yes};
  options.remote.cancel = &interruptFlag();
  options.progress = [&](std::uint64_t done, std::uint64_t total) {
    progress.setTotal(total);
    progress.update(done);
  };
  const TidyResult result = tidySet(a.address, options);
  a.json ? printTidyJson(a, result) : printTidied(a, result);
  return 0;
}

}  // namespace

void addTidy(CLI::App& app, Chosen& chosen) {
  auto a = std::make_shared<TidyArguments>();
  CLI::App* command = app.add_subcommand("tidy", "Remove old revisions of a set in S3-compatible storage");
  command->footer(
      "Example:\n  filiform tidy s3://BUCKET/lab/column.fil\n"
      "Lists the revisions of the set: objects, bytes, age of the youngest object. With --yes it removes the old ones. "
      "A revision stays if CURRENT names it, if one that stays uses its files, or if something of it is younger than "
      "--older-than: a push may be running. Open readers of a removed revision then fail. Nothing else is touched.");
  command->add_option("ADDRESS", a->address, "where the set is: s3://BUCKET/PATH/NAME.fil")->required();
  command->add_flag("--yes", a->yes, "remove; without it only list");
  command->add_option("--older-than", a->days, "age from which a revision is old, days (at least 1)")
      ->check(CLI::Range(1.0, 36'500.0))
      ->capture_default_str();
  command->add_flag("--json", a->json, "print one JSON object");
  addProgressOption(*command);
  command->callback([a, &chosen] { chosen = [a] { return runTidy(*a); }; });
}

}  // namespace filiform::tools
