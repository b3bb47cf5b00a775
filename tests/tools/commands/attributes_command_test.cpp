// filiform attributes.
#include "tests/support/process.h"
#include "tests/support/temp_folder.h"

#include <string>
#include <vector>

#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

namespace filiform {
namespace {

using test::Outcome;
using test::runFiliform;

class AttributesCommand : public ::testing::Test {
 protected:
  void SetUp() override {
    for (const char* const name : {"a", "b", "c"})
      test::writeBytes(folder_ / (std::string(name) + ".swc"), "1 1 0 0 0 1 -1\n2 3 0 0 9 1 1\n");
    const Outcome made = runFiliform({"ingest", folder_ / "a.swc", folder_ / "b.swc", folder_ / "c.swc", "-o", set_});
    ASSERT_EQ(made.exit_code, 0) << made.err;
    test::writeBytes(table_, "cell;type;depth\na;Tm3;1,5\nb;Mi1;12,25\nz;;3\n");
  }
  test::TempFolder folder_;
  std::string set_ = folder_ / "s.fil", table_ = folder_ / "t.csv";
};

TEST_F(AttributesCommand, GivesATableToASetThatExists) {
  const Outcome given = runFiliform({"attributes", set_, "--table", table_, "--key", "cell"});
  ASSERT_EQ(given.exit_code, 0) << given.err;
  EXPECT_NE(given.out.find("cells with a row of t.csv: 2, without: 1; rows without a cell: 1"), std::string::npos)
      << given.out;
  EXPECT_NE(given.out.find("  depth (real, new): given to 2 cells"), std::string::npos) << given.out;
  const Outcome deep = runFiliform({"cells", set_, "--json", "--where", "depth>=2", "--where", "type=Mi*"});
  EXPECT_EQ(nlohmann::json::parse(deep.out).size(), 1u) << deep.out << deep.err;
  test::writeBytes(table_, "cell,type\na,Tm4\n");
  const Outcome json = runFiliform({"attributes", set_, "--table", table_, "--key", "cell", "--replace", "--json"});
  ASSERT_EQ(json.exit_code, 0) << json.err;
  const nlohmann::json result = nlohmann::json::parse(json.out);
  EXPECT_EQ(result.at("attributes").at(0).at("replaced"), 1);
  EXPECT_EQ(result.at("cells_without_row"), 2);
  EXPECT_EQ(result.at("unchanged"), false);
  const nlohmann::json cells = nlohmann::json::parse(runFiliform({"cells", set_, "--json"}).out);
  EXPECT_EQ(cells.at(0).at("attributes"), nlohmann::json({{"depth", 1.5}, {"type", "Tm4"}}));
  EXPECT_EQ(runFiliform({"verify", "--deep", set_}).exit_code, 0);
}

TEST_F(AttributesCommand, RefusalsSayWhatToDo) {
  ASSERT_EQ(runFiliform({"attributes", set_, "--table", table_, "--key", "cell"}).exit_code, 0);
  const std::string before = test::readBytes(set_ + "/CURRENT");
  test::writeBytes(folder_ / "other.csv", "cell,type\na,Mi9\n");
  const auto refused = [&](const std::vector<std::string>& arguments, int code, const char* text) {
    const Outcome outcome = runFiliform(arguments);
    EXPECT_EQ(outcome.exit_code, code) << outcome.err;
    EXPECT_TRUE(outcome.oneLineOnStderr()) << outcome.err;
    EXPECT_NE(outcome.err.find(text), std::string::npos) << outcome.err;
  };
  refused({"attributes", set_, "--table", table_}, 2, "--key");
  refused({"attributes", set_, "--table", table_, "--key", "name"}, 1, "it has cell, type, depth");
  refused({"attributes", set_, "--table", folder_ / "none.csv", "--key", "cell"}, 3, "none.csv");
  refused({"attributes", folder_ / "none.fil", "--table", table_, "--key", "cell"}, 3, "filiform ingest");
  refused({"attributes", set_, "--table", table_, "--key", "type"}, 1, "does --key name the right column?");
  refused({"attributes", set_, "--table", folder_ / "other.csv", "--key", "cell"}, 1, "--replace");
  refused({"attributes", "http://localhost/x.fil", "--table", table_, "--key", "cell"}, 2, "SET");
  EXPECT_EQ(test::readBytes(set_ + "/CURRENT"), before);
}

}  // namespace
}  // namespace filiform
