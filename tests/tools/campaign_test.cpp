// Every command of the program on damaged and lying sets, in folders and on servers, and on damaged input: the right
// answer, or one line and exit code 1 or 3; no signal, bounded memory. `tools/test` runs a sample, `tools/test --long`
// everything.
#include "tests/support/campaign.h"

#include "index/file/internal/digest.h"
#include "tests/support/process.h"
#include "tests/support/sanitized.h"
#include "tests/support/servers/http_server.h"
#include "tests/support/temp_folder.h"

#include <algorithm>
#include <array>
#include <cstdint>
#include <cstdio>
#include <filesystem>
#include <functional>
#include <map>
#include <random>
#include <sstream>
#include <string>
#include <vector>

#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

namespace filiform {
namespace {

namespace fs = std::filesystem;
using test::Outcome;
using test::readBytes;
using test::runFiliform;
using test::writeBytes;
using Random = std::mt19937_64;

constexpr std::uint64_t kCampaignSeed = 47;
constexpr std::uint64_t kGiven = 64ull << 20;                 // --memory and --budget
constexpr std::uint64_t kMostPeak = (256ull << 20) + kGiven;  // resident

struct CampaignCommand {
  std::string name;
  std::vector<std::string> words;  // SET stands for the set, INPUT for the input, OUT for a name that is free
  bool draws = false;              // by OpenGL
};

const std::vector<CampaignCommand>& readers() {
  static const std::vector<CampaignCommand> kReaders{
      {"verify", {"verify", "SET"}},
      {"verify --deep", {"verify", "--deep", "SET"}},
      {"info", {"info", "SET", "--parameters"}},
      {"cells", {"cells", "SET"}},
      {"measure", {"measure", "SET", "--features", "all", "--sholl", "10"}},
      {"contacts", {"contacts", "SET", "--within", "1", "--memory", "64MiB"}},
      {"compare", {"compare", "SET", "cell_00000", "cell_00001"}},
      {"nearest", {"nearest", "SET", "0", "700", "0", "--k", "3", "--budget", "64MiB"}},
      {"nearest --approximate", {"nearest", "SET", "0", "700", "0", "--approximate"}},
      {"nearest --box", {"nearest", "SET", "--box", "-50", "0", "-50", "50", "900", "50"}},
      {"path", {"path", "SET", "cell_00000:1", "cell_00000:200"}},
      {"export", {"export", "SET", "--all", "-o", "OUT/"}},
      {"export, shards", {"export", "SET", "--all", "-o", "OUT.precomputed"}},
      {"navigate", {"navigate", "SET", "--seconds", "0.1", "--budget", "64MiB", "--json"}},
      {"render", {"render", "SET", "-o", "OUT.png", "--size", "64x48"}, true},
  };
  return kReaders;
}
// Those that change a set have a copy of their own.
const std::vector<CampaignCommand>& changers() {
  static const std::vector<CampaignCommand> kChangers{
      {"ingest --add", {"ingest", "INPUT", "--add", "-o", "SET", "--memory", "64MiB"}},
      {"compact", {"compact", "SET", "--memory", "64MiB"}},
      {"ingest --remove", {"ingest", "--remove", "cell_00001", "-o", "SET", "--memory", "64MiB"}},
  };
  return kChangers;
}
const std::vector<CampaignCommand>& inputReaders() {
  static const std::vector<CampaignCommand> kInputReaders{
      {"check", {"check", "INPUT"}},
      {"check --tsv", {"check", "INPUT", "--tsv"}},
      {"ingest", {"ingest", "INPUT", "-o", "OUT.fil", "--memory", "64MiB"}},
  };
  return kInputReaders;
}

// What is done to the bytes of a file.
using Damage = std::function<std::string(const std::string&, Random&)>;
const std::vector<std::pair<std::string, Damage>>& damages() {
  static const auto at = [](const std::string& bytes, Random& random) { return random() % bytes.size(); };
  static const std::vector<std::pair<std::string, Damage>> kDamages{
      {"a bit",
       [](std::string bytes, Random& random) {
         bytes[at(bytes, random)] ^= static_cast<char>(1 << random() % 8);
         return bytes;
       }},
      {"a cut", [](const std::string& bytes, Random& random) { return bytes.substr(0, at(bytes, random)); }},
      {"no bytes", [](const std::string&, Random&) { return std::string(); }},
      {"more bytes", [](const std::string& bytes, Random&) { return bytes + std::string(1000, '\0'); }},
      {"large numbers",
       [](std::string bytes, Random& random) {
         const std::size_t first = at(bytes, random);
         for (std::size_t i = first; i < std::min(bytes.size(), first + 8); ++i) bytes[i] = '\xff';
         return bytes;
       }},
      {"a block twice",
       [](const std::string& bytes, Random& random) {
         const std::size_t first = at(bytes, random);
         return bytes.substr(0, first) + bytes.substr(first / 2);
       }},
  };
  return kDamages;
}

std::vector<std::string> filesBelow(const std::string& folder) {
  std::vector<std::string> files;
  for (const auto& entry : fs::recursive_directory_iterator(folder))
    if (entry.is_regular_file()) files.push_back(fs::relative(entry.path(), folder));
  std::sort(files.begin(), files.end());
  return files;
}

class Campaign : public ::testing::Test {
 protected:
  void SetUp() override {
    ASSERT_EQ(runFiliform({"synth", path("in.zip"), "--cells", "3", "--seed", "1"}).exit_code, 0);
    ASSERT_EQ(runFiliform({"ingest", path("in.zip"), "-o", path("good.fil"), "--capacity", "512"}).exit_code, 0);
    writeBytes(path("new.swc"), "1 1 0 0 0 5 -1\n2 3 10 0 0 1 1\n3 3 20 0 0 1 2\n4 3 30 5 0 1 3\n");
  }
  void TearDown() override {
    for (const auto& [key, row] : counts_) {
      test::tell(key + ": " + std::to_string(row.runs) + " runs, " + std::to_string(row.refused) + " refused, " +
                 std::to_string(row.peak >> 20) + " MiB at most");
    }
  }
  std::string path(const std::string& name) const { return folder_ / name; }

  Outcome run(const CampaignCommand& command, const std::string& set, const std::string& input) {
    std::vector<std::string> words;
    for (const std::string& word : command.words)
      words.push_back(word == "SET"             ? set
                      : word == "INPUT"         ? input
                      : word.starts_with("OUT") ? path("out" + std::to_string(++outputs_) + word.substr(3))
                                                : word);
    // The OpenGL driver leaks (see tests/CMakeLists.txt), and reserves more addresses than the limit.
    const std::string line = command.draws      ? "ASAN_OPTIONS=detect_leaks=0:strict_string_checks=1 "
                             : test::kSanitized ? ""
                                                : "ulimit -v 8388608; ";
    Outcome outcome = test::runFiliformInShell(line + "exec \"$@\"", words);
    for (const std::string& word : words)  // what is named after this run
      for (std::size_t found; word.starts_with(path("out")) && (found = outcome.out.find(word)) != std::string::npos;)
        outcome.out.replace(found, word.size(), "OUT");
    return outcome;
  }

  // `usual`: the answer on undamaged bytes, or null where another answer may be right.
  void judge(const CampaignCommand& command, const std::string& kind, const Outcome& outcome, const Outcome* usual) {
    Count& count = counts_[command.name + ", " + kind];
    ++count.runs;
    count.peak = std::max(count.peak, outcome.peak_bytes);
    if (outcome.exit_code == 0) {
      if (usual != nullptr) {
        EXPECT_EQ(outcome.out, usual->out);
      }
    } else {
      ++count.refused;
      EXPECT_TRUE(outcome.exit_code == 1 || outcome.exit_code == 3) << outcome.exit_code << ": " << outcome.err;
      const bool is_report = command.name.starts_with("check") && outcome.err.empty() && !outcome.out.empty();
      EXPECT_TRUE(outcome.oneLineOnStderr() || is_report) << outcome.err;
    }
    if (!test::kSanitized) {
      EXPECT_LE(outcome.peak_bytes, kMostPeak) << outcome.err;
    }
  }

  // One command of a list each time in a sample, all of them in the whole campaign.
  std::vector<const CampaignCommand*> some(const std::vector<CampaignCommand>& commands) {
    std::vector<const CampaignCommand*> chosen;
    if (test::wholeCampaign()) {
      for (const CampaignCommand& command : commands) chosen.push_back(&command);
    } else {
      chosen.push_back(&commands[turn_++ % commands.size()]);
    }
    return chosen;
  }
  // Under a sanitizer, four of five cases.
  bool leavesOut() { return test::kSanitized && !test::wholeCampaign() && cases_++ % 5 != 0; }
  static int rounds() { return test::wholeCampaign() ? 20 : 1; }

  const Outcome& usual(const CampaignCommand& command, const std::string& set) {
    auto [found, is_new] = usual_.try_emplace(command.name);
    if (is_new) {
      found->second = run(command, set, path("new.swc"));
      EXPECT_EQ(found->second.exit_code, 0) << command.name << ": " << found->second.err;
    }
    return found->second;
  }

  // The commands on what lies in `folder` and is named `target`, with each file damaged in each way. Of a set, an
  // answer must be the usual one, and verify must see the damage in a folder; input may be read in part.
  void damageEveryFile(const std::string& folder, const std::string& target,
                       const std::vector<CampaignCommand>& commands, const std::string& where, bool is_set) {
    const std::string input = is_set ? path("new.swc") : target;
    for (const CampaignCommand& command : commands)
      if (is_set) usual(command, target);
    Random random(kCampaignSeed);
    for (int round = 0; round < rounds(); ++round)
      for (const std::string& file : filesBelow(folder)) {
        const std::string good = readBytes(folder + "/" + file);
        for (const auto& [kind, damage] : damages()) {
          if (leavesOut()) continue;
          const std::string bad = damage(good, random);
          writeBytes(folder + "/" + file, bad);
          for (const CampaignCommand* command : some(commands)) {
            SCOPED_TRACE(command->name + where + ", " + kind + " of " + file + ", round " + std::to_string(round));
            judge(*command, kind + where, run(*command, target, input), is_set ? &usual(*command, target) : nullptr);
          }
          if (target == path("good.fil") && bad != good) {
            EXPECT_NE(run(readers().front(), target, "").exit_code, 0) << "verify, " << kind << " of " << file;
          }
        }
        writeBytes(folder + "/" + file, good);
      }
  }
  void damageInput(const std::string& folder, const std::string& input, const std::string& where) {
    damageEveryFile(folder, input, inputReaders(), where, false);
  }

  struct Count {
    std::uint64_t runs = 0, refused = 0, peak = 0;
  };
  test::TempFolder folder_;
  std::map<std::string, Count> counts_;
  std::map<std::string, Outcome> usual_;
  std::size_t turn_ = 0, cases_ = 0;
  int outputs_ = 0;
};

TEST_F(Campaign, DamagedSets) { damageEveryFile(path("good.fil"), path("good.fil"), readers(), "", true); }

TEST_F(Campaign, DamagedSetsOnAServer) {
  test::HttpServer server(folder_.path());
  std::vector<CampaignCommand> commands;
  for (CampaignCommand command : readers()) {
    if (command.words.front() != "verify" || command.name == "verify")
      command.words.insert(command.words.end(), {"--cache", path("cache")});
    commands.push_back(command);
  }
  commands.push_back({"pull", {"pull", "SET", "-o", "OUT.fil"}});
  damageEveryFile(path("good.fil"), server / "good.fil", commands, ", server", true);
}

// A manifest that states other numbers, with all digests in order: XXH3 is no signature.
TEST_F(Campaign, LyingManifests) {
  const std::vector<nlohmann::json> lies{
      0, -1, 3, std::uint64_t{5'000'000'000}, 0xFFFF'FFFFu, 1e300, std::uint64_t{1} << 60, "many"};
  const std::string set = path("good.fil");
  const std::string current = readBytes(set + "/CURRENT");
  const std::string revision = current.substr(0, current.size() - 1);
  const nlohmann::json manifest = nlohmann::json::parse(readBytes(set + "/" + revision + "/manifest.json"));
  std::vector<nlohmann::json::json_pointer> numbers;
  const nlohmann::json flat = manifest.flatten();
  for (const auto& [pointer, value] : flat.items())
    if (value.is_number()) numbers.emplace_back(pointer);
  ASSERT_GT(numbers.size(), 20u);
  for (const CampaignCommand& command : readers()) usual(command, set);
  std::size_t turn = 0;
  for (const nlohmann::json::json_pointer& number : numbers)
    for (const nlohmann::json& lie : lies) {
      if ((!test::wholeCampaign() && turn++ % 3 != 0) || leavesOut()) continue;
      nlohmann::json told = manifest;
      told[number] = lie;
      const std::string text = told.dump();
      std::array<char, 32> name{};
      std::snprintf(name.data(), name.size(), "r-%016llx", static_cast<unsigned long long>(internal::checksum(text)));
      const std::string lying = path("lying.fil");
      fs::remove_all(lying);
      fs::create_directories(lying);
      fs::copy(set + "/" + revision, lying + "/" + name.data());
      writeBytes(lying + "/" + name.data() + "/manifest.json", text);
      writeBytes(lying + "/CURRENT", std::string(name.data()) + "\n");
      for (const CampaignCommand* command : some(readers())) {
        SCOPED_TRACE(command->name + ", " + number.to_string() + " = " + lie.dump());
        judge(*command, "a lying manifest", run(*command, lying, ""), nullptr);
      }
    }
}

TEST_F(Campaign, ChangesOfDamagedSets) {
  Random random(kCampaignSeed);
  for (int round = 0; round < rounds(); ++round)
    for (const std::string& file : filesBelow(path("good.fil")))
      for (const auto& [kind, damage] : damages())
        for (const CampaignCommand* command : some(changers())) {
          if (leavesOut()) continue;
          SCOPED_TRACE(command->name + ", " + kind + " of " + file + ", round " + std::to_string(round));
          const std::string set = path("changed.fil");
          fs::remove_all(set);
          fs::copy(path("good.fil"), set, fs::copy_options::recursive);
          writeBytes(set + "/" + file, damage(readBytes(set + "/" + file), random));
          std::map<std::string, std::string> before;
          for (const std::string& name : filesBelow(set)) before[name] = readBytes(set + "/" + name);
          const Outcome outcome = run(*command, set, path("new.swc"));
          judge(*command, kind, outcome, nullptr);
          if (outcome.exit_code == 0) continue;
          for (const auto& [name, bytes] : before) EXPECT_EQ(readBytes(set + "/" + name) == bytes, true) << name;
        }
}

TEST_F(Campaign, DamagedInput) {
  fs::create_directories(path("in"));
  fs::copy(path("in.zip"), path("in/cells.zip"));
  writeBytes(path("in/cell.swc"), readBytes(path("new.swc")));
  writeBytes(path("in/cell.asc"),
             "(\"Soma\" (CellBody)\n (0 0 0 1) (1 0 0 1) (1 1 0 1))\n((Dendrite)\n (2 0 0 1) (5 0 0 1)\n ( (7 1 0 1) "
             "(9 2 0 1) | (7 -1 0 1) (9 -2 0 1) ))\n");
  writeBytes(
      path("in/cell.json"),
      R"({"neurons": [{"idString": "AA1", "soma": {"x": 0, "y": 0, "z": 0}, "axon": [{"sampleNumber": 1, "structureIdentifier": 2, "x": 1, "y": 2, "z": 3, "radius": 1, "parentNumber": -1}, {"sampleNumber": 2, "structureIdentifier": 2, "x": 2, "y": 2, "z": 3, "radius": 1, "parentNumber": 1}]}]})");
  const std::string make =
      "cd '" + folder_.path() + "' && tar -czf in/cells.tgz new.swc && gzip -c new.swc > in/packed.swc.gz";
  ASSERT_EQ(std::system(make.c_str()), 0);
  for (const std::string& file : filesBelow(path("in"))) {  // each alone, so that others cannot hide its end
    fs::remove_all(path("one"));
    fs::create_directories(path("one"));
    fs::copy(path("in/" + file), path("one/" + file));
    damageInput(path("one"), path("one/" + file), ", " + file);
  }
  damageInput(path("in"), path("in"), ", a folder");
}

TEST_F(Campaign, DamagedSkeletons) {
  ASSERT_EQ(runFiliform({"export", path("good.fil"), "--all", "-o", path("cells.precomputed")}).exit_code, 0);
  damageInput(path("cells.precomputed"), path("cells.precomputed"), ", skeletons");
  test::HttpServer server(folder_.path());
  damageInput(path("cells.precomputed"), server / "cells.precomputed", ", skeletons on a server");
}

TEST_F(Campaign, DamagedCircuits) {
  const Outcome made = runFiliform({"synth", path("circuit"), "--format", "sonata", "--cells", "3", "--seed", "2"});
  ASSERT_EQ(made.exit_code, 0) << made.err;
  damageInput(path("circuit"), path("circuit/circuit_config.json"), ", a circuit");
}

}  // namespace
}  // namespace filiform
