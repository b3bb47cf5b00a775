// filiform contacts as a process.
#include "tests/support/process.h"
#include "tests/support/temp_folder.h"
#include "tests/support/zip_entries.h"

#include <filesystem>
#include <map>
#include <string>
#include <vector>

#include <gtest/gtest.h>

namespace filiform {
namespace {

using test::Outcome;
using test::runFiliform;

class ContactsCommand : public ::testing::Test {
 protected:
  void SetUp() override {
    // The axon of `a` crosses a dendrite of `b` at 1 um, between (4 0 0) and (4 0 1). `c` is `b` again; `d` is far
    // away.
    test::writeBytes(folder_ / "a.swc", "1 1 -2 0 0 1 -1\n5 2 0 0 0 .25 1\n6 2 8 0 0 .25 5\n");
    const std::string b = "1 1 4 9 1 1 -1\n2 3 4 5 1 .5 1\n3 3 4 -3 1 .5 2\n";
    test::writeBytes(folder_ / "b.swc", b);
    test::writeBytes(folder_ / "c.swc", b + "# once more\n");
    test::writeBytes(folder_ / "d.swc", "1 3 90 90 90 1 -1\n2 3 95 90 90 1 1\n");
    test::writeBytes(folder_ / "types.csv", "cell,mtype\na,L4\nb,L5\nd,L4\n");
    const Outcome made =
        runFiliform({"ingest", folder_ / "a.swc", folder_ / "b.swc", folder_ / "c.swc", folder_ / "d.swc", "-o", set_,
                     "--attributes", folder_ / "types.csv", "--key", "cell", "--capacity", "2"});
    ASSERT_EQ(made.exit_code, 0) << made.err;
  }
  Outcome contacts(std::vector<std::string> words) const {
    words.insert(words.begin(), {"contacts", set_});
    return runFiliform(words);
  }
  test::TempFolder folder_;
  std::string set_ = folder_ / "set.fil";
};

const char* const kTitles =
    "from\tto\tdistance_um\tpairs\tfrom_type\tfrom_sample\tfrom_x\tfrom_y\tfrom_z\tfrom_length_um\tfrom_path_um\t"
    "to_type\tto_sample\tto_x\tto_y\tto_z\tto_length_um\tto_path_um\n";

TEST_F(ContactsCommand, WritesARowForEachSite) {
  const Outcome outcome = contacts({"--within", "1", "--no-copies"});
  ASSERT_EQ(outcome.exit_code, 0) << outcome.err;
  EXPECT_EQ(outcome.out, std::string(kTitles) + "a\tb\t1\t1\taxon\t6\t4\t0\t0\t8\t6\tbasal\t3\t4\t0\t1\t8\t9\n");
  EXPECT_NE(outcome.err.find("1 cell is a copy of another ('c' of 'b'); their contacts are left out"),
            std::string::npos)
      << outcome.err;
  EXPECT_EQ(contacts({"--within", "0.999", "--no-copies"}).out, kTitles);
  const Outcome surface = contacts({"--within", ".25", "--no-copies", "--surface"});
  EXPECT_NE(surface.out.find("a\tb\t0.25\t1\t"), std::string::npos) << surface.out << surface.err;
}

TEST_F(ContactsCommand, ConditionsAndTypesChooseBothSides) {
  const Outcome both = contacts({"--within", "1", "--types", "axon,dendrite"});
  EXPECT_NE(both.out.find("\na\tb\t"), std::string::npos);
  EXPECT_NE(both.out.find("\na\tc\t"), std::string::npos);
  EXPECT_EQ(both.out.find("\nb\tc\t"), std::string::npos) << "two dendrites";
  EXPECT_NE(both.err.find("--no-copies"), std::string::npos) << both.err;
  const Outcome back = contacts({"--within", "1", "--types", "dendrite,axon", "--from", "mtype=L5"});
  EXPECT_NE(back.out.find("\nb\ta\t1\t1\tbasal\t3\t"), std::string::npos) << back.out;
  EXPECT_EQ(back.out.find("\nc\t"), std::string::npos);
  EXPECT_EQ(contacts({"--within", "1", "--types", "apical+soma,any", "--from", "mtype=L5"}).out, kTitles);
}

TEST_F(ContactsCommand, AMatrixCountsSites) {
  const std::string out = folder_ / "matrix.tsv";
  const Outcome outcome = contacts({"--within", "1", "--no-copies", "--matrix", "mtype", "-o", out});
  ASSERT_EQ(outcome.exit_code, 0) << outcome.err;
  EXPECT_EQ(outcome.out.substr(outcome.out.find(": ")), ": 1 contact site of 1 pair of segments\n");
  EXPECT_EQ(test::readBytes(out), "mtype\tL4\tL5\nL4\t0\t1\nL5\t1\t0\n");
  contacts({"--within", "1", "--types", "axon,dendrite", "--matrix", "mtype", "-o", out});
  EXPECT_EQ(test::readBytes(out), "mtype\tL4\tL5\t-\nL4\t0\t1\t1\nL5\t0\t0\t0\n-\t0\t0\t0\n");
}

TEST_F(ContactsCommand, ArraysOfNumpy) {
  const std::string out = folder_ / "contacts.npz";
  const Outcome outcome = contacts({"--within", "1", "--types", "axon,dendrite", "-o", out});
  ASSERT_EQ(outcome.exit_code, 0) << outcome.err;
  const std::map<std::string, std::string> arrays = test::entriesOf(out);
  EXPECT_EQ(arrays.size(), 15u);
  for (const auto& [name, part] :
       std::map<std::string, std::string>{{"distance_um.npy", "'<f8', 'fortran_order': False, 'shape': (2,)"},
                                          {"from_xyz.npy", "(2,3)"},
                                          {"to.npy", "'<i4'"},
                                          {"cells.npy", "'<U1'"}})
    EXPECT_NE(arrays.at(name).find(part), std::string::npos) << name;
}

TEST_F(ContactsCommand, ThreadsGiveTheSameBytes) {
  ASSERT_EQ(runFiliform({"synth", folder_ / "s.zip", "--cells", "6", "--seed", "5"}).exit_code, 0);
  ASSERT_EQ(runFiliform({"ingest", folder_ / "s.zip", "-o", folder_ / "s.fil", "--no-levels"}).exit_code, 0);
  const auto with = [&](const char* threads) {
    return runFiliform({"contacts", folder_ / "s.fil", "--within", "5", "--surface", "--threads", threads}).out;
  };
  const std::string one = with("1");
  EXPECT_GT(one.size(), 1000u);
  EXPECT_EQ(one, with("2"));
  EXPECT_EQ(one, with("3"));
}

TEST_F(ContactsCommand, MistakesAreOneLineWithNearNames) {
  const auto expectLine = [&](std::vector<std::string> words, const std::string& part) {
    const std::string out = folder_ / "none.tsv";
    words.insert(words.end(), {"-o", out});
    const Outcome outcome = contacts(words);
    EXPECT_EQ(outcome.exit_code, 2) << outcome.err;
    EXPECT_TRUE(outcome.oneLineOnStderr()) << outcome.err;
    EXPECT_NE(outcome.err.find(part), std::string::npos) << outcome.err;
    EXPECT_FALSE(std::filesystem::exists(out));
  };
  expectLine({"--within", "1", "--matrix", "mtpye"}, "did you mean 'mtype'");
  expectLine({"--within", "1", "--types", "axno,dendrite"}, "did you mean 'axon'");
  expectLine({"--within", "1", "--types", "axon,dendrites"}, "did you mean 'dendrite'");
  expectLine({"--within", "1", "--from", "mtpye=L4"},
             "--from mtpye=L4: the cells have no attribute of this name; did you mean 'mtype'?");
  expectLine({"--within", "1", "--to", "mtype"}, "--to ");
  expectLine({"--within", "0"}, "above 0 um");
  expectLine({"--within", "-1"}, "above 0 um");
  expectLine({"--within", "nan"}, "finite number");
  expectLine({"--within", "1e6", "--no-copies"}, ": 8 pairs; give a smaller distance");
  expectLine({"--within", "1", "--memory", "1MiB"}, "at least 64.0 MiB");
  const Outcome csv = contacts({"--within", "1", "-o", folder_ / "contacts.csv"});
  EXPECT_EQ(csv.exit_code, 2);
  EXPECT_NE(csv.err.find("must end in .tsv or .npz"), std::string::npos) << csv.err;
}

}  // namespace
}  // namespace filiform
