// Circuits that are wrong, damaged or hostile: each is one line, and nothing is left.
#include "index/errors.h"
#include "index/set/tile_set.h"
#include "tests/support/campaign.h"
#include "tests/support/process.h"
#include "tests/support/scenes/small_circuit.h"
#include "tests/support/temp_folder.h"

#include <cstdlib>
#include <filesystem>
#include <functional>
#include <map>
#include <random>
#include <string>
#include <utility>
#include <vector>

#include <gtest/gtest.h>

namespace filiform {
namespace {

namespace fs = std::filesystem;
using test::Outcome;
using test::outputOf;
using test::runFiliform;
using test::SmallCircuit;
using test::TempFolder;
using test::writePlaces;

class CircuitMistakes : public ::testing::Test {
 protected:
  static void SetUpTestSuite() {
    folder_ = new TempFolder();
    circuit_ = new std::string(*folder_ / "circuit");
    const Outcome made = runFiliform({"synth", *circuit_, "--format", "sonata", "--cells", "12", "--library", "2"});
    ASSERT_EQ(made.exit_code, 0) << made.err;
  }
  static void TearDownTestSuite() {
    delete folder_;
    delete circuit_;
  }
  static std::string nodes() { return *circuit_ + "/column/nodes.h5"; }
  static std::string container() { return *circuit_ + "/morphologies/merged-morphologies.h5"; }

  static TempFolder* folder_;
  static std::string* circuit_;
};
TempFolder* CircuitMistakes::folder_ = nullptr;
std::string* CircuitMistakes::circuit_ = nullptr;

TEST_F(CircuitMistakes, BadInputIsOneLineAndLeavesNothing) {
  struct Case {
    std::string name;
    int exit_code;
    std::vector<std::string> words;
    std::function<std::vector<std::string>(const std::string& folder)> make;
  };
  const auto plain = [](const std::string& folder, const std::function<void(Hdf5Writer&)>& fill) {
    const SmallCircuit circuit(folder);
    circuit.write(fill);
    return std::vector<std::string>{circuit.config()};
  };
  const std::vector<Case> cases{
      {"cycle",
       1,
       {"circle", "$A -> $B -> $A"},
       [](const std::string& folder) {
         const SmallCircuit circuit(folder, R"(,"manifest":{"$A":"$B/x","$B":"$A/y"})");
         return std::vector<std::string>{circuit.config()};
       }},
      {"variable",
       1,
       {"$NOWHERE", "not in the manifest"},
       [](const std::string& folder) {
         const SmallCircuit circuit(folder, R"(,"manifest":{"$A":"$NOWHERE/x"})");
         return std::vector<std::string>{circuit.config()};
       }},
      {"container",
       3,
       {"merged.h5", "population p"},
       [](const std::string& folder) {
         const SmallCircuit circuit(folder);
         test::writeBytes(circuit.config(), R"({"networks":{"nodes":[{"nodes_file":"nodes.h5","populations":{"p":)"
                                            R"({"alternate_morphologies":{"h5v1":"merged.h5"}}}}]}})");
         circuit.write([](Hdf5Writer& out) {
           out.texts("nodes/p/0/morphology", {"a"});
           writePlaces(out, 1);
         });
         return std::vector<std::string>{circuit.config()};
       }},
      {"population",
       1,
       {"no population q", "holds p"},
       [](const std::string& folder) {
         const SmallCircuit circuit(folder);
         circuit.write([](Hdf5Writer& out) { writePlaces(out, 1); });
         return std::vector<std::string>{circuit.nodes(), "--morphologies", folder, "--population", "q"};
       }},
      {"population of the circuit",
       1,
       {"no population q", "has p"},
       [](const std::string& folder) {
         const SmallCircuit circuit(folder);
         circuit.write([](Hdf5Writer& out) { writePlaces(out, 1); });
         return std::vector<std::string>{circuit.config(), "--population", "q"};
       }},
      {"number as text",
       1,
       {"population p, node 0", "morphology is the number"},
       [&](const std::string& folder) {
         return plain(folder, [](Hdf5Writer& out) {
           out.integers("nodes/p/node_type_id", "i64", 1, std::vector<std::int64_t>{7});
           out.reals("nodes/p/0/morphology", "f64", 1, std::vector<double>{3});
           writePlaces(out, 1);
         });
       }},
      {"text as number",
       1,
       {"population p, node 0", "x is the text 'left'"},
       [&](const std::string& folder) {
         return plain(folder, [](Hdf5Writer& out) {
           out.integers("nodes/p/node_type_id", "i64", 1, std::vector<std::int64_t>{7});
           for (const char* const axis : {"y", "z"})
             out.reals(std::string("nodes/p/0/") + axis, "f64", 1, std::vector<double>{0});
           out.texts("nodes/p/0/x", {"left"});
         });
       }},
      {"quaternion",
       1,
       {"population p, node 1", "quaternion has length 0"},
       [&](const std::string& folder) {
         return plain(folder, [](Hdf5Writer& out) {
           out.integers("nodes/p/node_type_id", "i64", 1, std::vector<std::int64_t>{7, 7});
           writePlaces(out, 2);
           out.reals("nodes/p/0/orientation_w", "f64", 1, std::vector<double>{2, 0});
           for (const char* const part : {"x", "y", "z"})
             out.reals(std::string("nodes/p/0/orientation_") + part, "f64", 1, std::vector<double>{0, 0});
         });
       }},
      {"part of a quaternion",
       1,
       {"population p, node 0", "1 of the four"},
       [&](const std::string& folder) {
         return plain(folder, [](Hdf5Writer& out) {
           out.integers("nodes/p/node_type_id", "i64", 1, std::vector<std::int64_t>{7});
           writePlaces(out, 1);
           out.reals("nodes/p/0/orientation_w", "f64", 1, std::vector<double>{1});
         });
       }},
      {"out of the folder",
       1,
       {"node 0", "leads out"},
       [&](const std::string& folder) {
         return plain(folder, [](Hdf5Writer& out) {
           out.integers("nodes/p/node_type_id", "i64", 1, std::vector<std::int64_t>{7});
           out.texts("nodes/p/0/morphology", {"../../secret"});
           writePlaces(out, 1);
         });
       }},
      {"not json",
       1,
       {"not JSON"},
       [](const std::string& folder) {
         const SmallCircuit circuit(folder);
         test::writeBytes(circuit.config(), R"({"networks": [)");
         return std::vector<std::string>{circuit.config()};
       }},
      {"not hdf5",
       1,
       {"nodes.h5", "not an HDF5 file"},
       [](const std::string& folder) {
         const SmallCircuit circuit(folder);
         test::writeBytes(circuit.nodes(), "hello");
         return std::vector<std::string>{circuit.config()};
       }},
      {"nodes alone",
       1,
       {"nodes.h5", "--morphologies"},
       [](const std::string& folder) {
         const SmallCircuit circuit(folder);
         circuit.write([](Hdf5Writer& out) { writePlaces(out, 1); });
         return std::vector<std::string>{circuit.nodes()};
       }},
      {"two circuits",
       2,
       {"read alone"},
       [](const std::string& folder) {
         const SmallCircuit circuit(folder);
         circuit.write([](Hdf5Writer& out) { writePlaces(out, 1); });
         return std::vector<std::string>{circuit.config(), circuit.config()};
       }},
  };
  for (const Case& one : cases) {
    SCOPED_TRACE(one.name);
    const TempFolder folder;
    std::vector<std::string> arguments = one.make(folder / "in");
    arguments.insert(arguments.begin(), "ingest");
    arguments.insert(arguments.end(), {"-o", folder / "out.fil"});
    const Outcome outcome = runFiliform(arguments);
    EXPECT_EQ(outcome.exit_code, one.exit_code);
    EXPECT_TRUE(outcome.oneLineOnStderr()) << outcome.err;
    for (const std::string& word : one.words) EXPECT_NE(outcome.err.find(word), std::string::npos) << outcome.err;
    EXPECT_FALSE(fs::exists(folder / "out.fil"));
  }
}

TEST_F(CircuitMistakes, ABillionNodesClaimedInASmallFileAreRefused) {
  const SmallCircuit circuit(*folder_ / "claim");
  circuit.write([](Hdf5Writer& out) {
    out.integers("nodes/p/node_type_id", "i64", 1, std::vector<std::int64_t>(1000, 7));
    writePlaces(out, 1000);
  });
  std::string bytes = test::readBytes(circuit.nodes());
  const std::string extent{"\xE8\x03\0\0\0\0\0\0", 8}, claim{"\0\xCA\x9A\x3B\0\0\0\0", 8};
  std::size_t replaced = 0;
  for (std::size_t at = bytes.find(extent); at != std::string::npos; at = bytes.find(extent, at + 8), ++replaced)
    bytes.replace(at, 8, claim);
  ASSERT_GT(replaced, 0u);
  test::writeBytes(circuit.nodes(), bytes);
  const Outcome outcome = runFiliform({"ingest", circuit.config(), "-o", *folder_ / "claim.fil"});
  EXPECT_NE(outcome.exit_code, 0);
  EXPECT_TRUE(outcome.oneLineOnStderr()) << outcome.err;
  EXPECT_NE(outcome.err.find("nodes.h5"), std::string::npos) << outcome.err;
  EXPECT_FALSE(fs::exists(*folder_ / "claim.fil"));
}

TEST_F(CircuitMistakes, AMissingMorphologyIsCountedAndNamed) {
  const SmallCircuit circuit(*folder_ / "missing");
  circuit.write([](Hdf5Writer& out) {
    out.integers("nodes/p/node_type_id", "i64", 1, std::vector<std::int64_t>{7, 7});
    out.texts("nodes/p/0/morphology", {"a", "nowhere"});
    writePlaces(out, 2);
  });
  const std::string set = *folder_ / "missing.fil";
  const Outcome made = runFiliform({"ingest", circuit.config(), "-o", set});
  EXPECT_EQ(made.exit_code, 0) << made.err;
  EXPECT_NE(made.out.find("nowhere.swc"), std::string::npos) << made.out;
  EXPECT_NE(made.out.find("W_BAD_LINE 1"), std::string::npos) << made.out;
  EXPECT_EQ(TileSet::open(set)->counts().cells, 1u);
}

TEST_F(CircuitMistakes, TheDeathOfTheReaderIsOneLineOfItsInput) {
  const std::string script = *folder_ / "dies";
  for (const auto& [body, words] : std::vector<std::pair<std::string, std::string>>{
           {"kill -SEGV $$", "crashed on it (SIGSEGV)"},
           {"exec sleep 60", "did not answer for 1 s"},
           {"exit 3", "exit code 3"},
           {"head -c 4 >/dev/null; echo 0123456789abcdef0123456789abcdef", "cannot be read"}}) {
    test::writeBytes(script, "#!/bin/sh\n" + body + "\n");
    fs::permissions(script, fs::perms::owner_all);
    ::setenv("FILIFORM_HDF5", script.c_str(), 1);
    ::setenv("FILIFORM_HDF5_SECONDS", "1", 1);
    const Outcome outcome = runFiliform({"ingest", container(), "-o", *folder_ / "dead.fil"});
    ::unsetenv("FILIFORM_HDF5");
    ::unsetenv("FILIFORM_HDF5_SECONDS");
    EXPECT_EQ(outcome.exit_code, 1) << body;
    EXPECT_TRUE(outcome.oneLineOnStderr()) << outcome.err;
    EXPECT_NE(outcome.err.find("merged-morphologies.h5"), std::string::npos) << outcome.err;
    EXPECT_NE(outcome.err.find(words), std::string::npos) << outcome.err;
    EXPECT_FALSE(fs::exists(*folder_ / "dead.fil"));
  }
  ::setenv("FILIFORM_HDF5", "/nowhere/filiform-hdf5", 1);
  const Outcome outcome = runFiliform({"ingest", container(), "-o", *folder_ / "dead.fil"});
  ::unsetenv("FILIFORM_HDF5");
  EXPECT_EQ(outcome.exit_code, 1);
  EXPECT_NE(outcome.err.find("FILIFORM_HDF5"), std::string::npos) << outcome.err;
}

// A program that is absent, or is none, loses the HDF5 files and nothing else.
TEST_F(CircuitMistakes, WithoutTheReaderTheOtherInputsAreRead) {
  test::writeBytes(*folder_ / "other.swc", "1 1 0 0 0 1 -1\n");
  for (const std::string& program : {std::string("/nowhere/filiform-hdf5"), *folder_ / "other.swc", *folder_ / ""}) {
    ::setenv("FILIFORM_HDF5", program.c_str(), 1);
    const Outcome outcome =
        runFiliform({"ingest", container(), *folder_ / "other.swc", "-o", *folder_ / "other.fil", "--force"});
    ::unsetenv("FILIFORM_HDF5");
    EXPECT_EQ(outcome.exit_code, 0) << outcome.err;
    EXPECT_NE(outcome.out.find("refused merged-morphologies.h5: cannot start the program that reads HDF5 files; set "
                               "FILIFORM_HDF5 to its path"),
              std::string::npos)
        << outcome.out;
    EXPECT_EQ(TileSet::open(*folder_ / "other.fil")->counts().cells, 1u);
  }
}

// It answers `create`, and then reads nothing: the pipe is full, and writing must not wait for ever.
TEST_F(CircuitMistakes, AWriterThatStopsReadingIsGivenUp) {
  const std::string script = *folder_ / "stuck";
  test::writeBytes(
      script, "#!/bin/sh\nprintf '\\0\\0\\0\\0\\0\\0\\0\\0\\302\\224\\323\\070\\005\\200\\006\\055'\nexec sleep 60\n");
  fs::permissions(script, fs::perms::owner_all);
  ::setenv("FILIFORM_HDF5", script.c_str(), 1);
  ::setenv("FILIFORM_HDF5_SECONDS", "1", 1);
  std::string said;
  {
    Hdf5Writer out(*folder_ / "stuck.h5");
    try {
      out.reals("values", "f64", 1, std::vector<double>(100'000, 1.5));
    } catch (const IoError& failure) {
      said = failure.what();
    }
  }
  ::unsetenv("FILIFORM_HDF5");
  ::unsetenv("FILIFORM_HDF5_SECONDS");
  EXPECT_NE(said.find("stuck.h5: the HDF5 library did not answer for 1 s"), std::string::npos) << said;
}

// Groups that hold each other as hard or soft links: a search through all paths would not end.
TEST_F(CircuitMistakes, GroupsThatContainThemselvesAreRefused) {
  const std::string script = *folder_ / "cycle.py";
  test::writeBytes(script, R"(import h5py, sys
f = h5py.File(sys.argv[1], 'w')
if sys.argv[2] == 'hard':
  g = f.create_group('a')
  for i in range(60): g['b%d' % i] = g
elif sys.argv[2] == 'soft':
  f.create_group('a/b')['c'] = h5py.SoftLink('/a')
else:
  f['nodes/p/node_type_id'] = [0]
  g = f.create_group('nodes/p/0/dynamics_params')
  g['again'] = f['nodes/p/0']
print('made'))");
  for (const char* const kind : {"hard", "soft", "nodes"}) {
    SCOPED_TRACE(kind);
    const std::string file = *folder_ / (std::string(kind) + ".h5");
    const std::string python = "/usr/bin/python3 '" + script + "' '" + file + "' " + kind + " 2>&1";
    if (outputOf(python).find("made") == std::string::npos) GTEST_SKIP() << "needs python3-h5py";
    std::vector<std::string> arguments{"check", file};
    if (std::string(kind) == "nodes") arguments.insert(arguments.end(), {"--morphologies", container()});
    const Outcome outcome = runFiliform(arguments);
    EXPECT_EQ(outcome.exit_code, 1);
    EXPECT_NE((outcome.out + outcome.err).find("has groups that contain themselves"), std::string::npos)
        << outcome.out << outcome.err;
  }
}

TEST_F(CircuitMistakes, TheProgramDoesNotLinkHdf5) {
  const std::string libraries = outputOf("ldd '" + test::filiformProgram().string() + "'");
  ASSERT_NE(libraries.find("libc.so"), std::string::npos);
  EXPECT_EQ(libraries.find("hdf5"), std::string::npos) << libraries;
}

// Flips bits of a file, or cuts it short; each outcome is a set or one line.
TEST_F(CircuitMistakes, MutatedFilesNeitherCrashNorHang) {
  ::setenv("FILIFORM_HDF5_SECONDS", "4", 1);
  const int rounds = test::wholeCampaign() ? 600 : 16;
  std::mt19937_64 random(20261124);
  const std::string folder = *folder_ / "mutated";
  const std::string nodes_bytes = test::readBytes(nodes()), container_bytes = test::readBytes(container());
  std::map<int, int> outcomes;
  int lines = 0;
  for (int round = 0; round < rounds; ++round) {
    fs::remove_all(folder);
    fs::copy(*circuit_, folder, fs::copy_options::recursive);
    const bool of_nodes = round % 3 != 0;
    std::string bytes = of_nodes ? nodes_bytes : container_bytes;
    if (round % 5 == 4) {
      bytes.resize(random() % bytes.size());
    } else {
      // Most structure lies in the first and last bytes of a container.
      const std::size_t span = of_nodes ? bytes.size() : std::min<std::size_t>(bytes.size(), 16384);
      for (int flips = 1 + static_cast<int>(random() % 8); flips > 0; --flips)
        bytes[random() % span] ^= static_cast<char>(1 << random() % 8);
    }
    test::writeBytes(folder + (of_nodes ? "/column/nodes.h5" : "/morphologies/merged-morphologies.h5"), bytes);
    const Outcome outcome = runFiliform({"check", folder + "/circuit_config.json", "--tsv"});
    ++outcomes[outcome.exit_code];
    EXPECT_TRUE(outcome.exit_code == 0 || outcome.exit_code == 1 || outcome.exit_code == 3)
        << round << ": " << outcome.exit_code << ' ' << outcome.err;
    if (outcome.exit_code == 3 || (outcome.exit_code == 1 && outcome.out.empty())) {
      EXPECT_TRUE(outcome.oneLineOnStderr()) << round << ": " << outcome.err;
      ++lines;
    }
  }
  ::unsetenv("FILIFORM_HDF5_SECONDS");
  test::tell("mutated circuits: " + std::to_string(rounds) + ", read " + std::to_string(outcomes[0]) + ", refused " +
             std::to_string(outcomes[1] + outcomes[3]) + " (" + std::to_string(lines) +
             " as a whole), crashed or hung 0");
}

}  // namespace
}  // namespace filiform
