// filiform replay: repeats a recorded session of `serve`, and compares it with the recording bit for bit.
#include "index/count_text.h"
#include "index/errors.h"
#include "index/set/tile_set.h"
#include "index/text.h"
#include "tools/commands/commands.h"
#include "tools/serve/session/session_replay.h"
#include "tools/words/answer.h"

#include <iostream>
#include <memory>
#include <string>

#include <CLI/CLI.hpp>

namespace filiform::tools {

namespace {

struct ReplayArguments {
  std::string set, recording;
  bool json = false;
};

int runReplay(const ReplayArguments& a) {
  const std::string revision = recordedRevision(a.recording);
  const auto set = TileSet::open(a.set);
  if (set->revision() != revision)
    throw InputError(inShort(a.recording) + ": was recorded on revision " + escaped(revision, 40) + "; " +
                     inShort(a.set) + " has " + set->revision() + ", so give the set as it was");
  const SessionReplay replay = replaySession(*set, a.recording);
  if (a.json) {
    std::cout << jsonText({{"set", replay.set},
                           {"revision", replay.revision},
                           {"ticks", replay.ticks},
                           {"hands", replay.hands},
                           {"proxies", replay.proxies},
                           {"differing_hands", replay.differing_hands},
                           {"differing_proxies", replay.differing_proxies},
                           {"equal", replay.isEqual()}})
              << '\n';
  } else {
    std::cout << counted(replay.ticks, "tick") << " with " << counted(replay.hands, "HAND frame") << ": "
              << replay.differing_hands << " positions of the hand differ from the recording\n"
              << counted(replay.proxies, "PROXY frame") << ": " << replay.differing_proxies
              << " differ from the recording\n";
  }
  return replay.isEqual() ? 0 : 1;
}

}  // namespace

void addReplay(CLI::App& app, Chosen& chosen) {
  auto a = std::make_shared<ReplayArguments>();
  CLI::App* command = app.add_subcommand("replay", "Repeat a recorded session of serve, bit for bit");
  command->footer(
      "Examples:\n  filiform replay column.fil session.rec\n  filiform replay column.fil session.rec --json\n"
      "serve --record-sessions DIR writes recordings. Exit code 1: a frame differs from the recording.");
  command->add_option("SET", a->set, "the tile set that the session travelled, in the same revision")->required();
  command->add_option("FILE", a->recording, "the recording, FILE.rec; FILE.rec.json and FILE.rec.frames lie beside it")
      ->required();
  command->add_flag("--json", a->json, "print one JSON object");
  command->callback([a, &chosen] { chosen = [a] { return runReplay(*a); }; });
}

}  // namespace filiform::tools
