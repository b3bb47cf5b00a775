// One version, in everything that states it.
#include "tests/support/folders.h"
#include "tests/support/process.h"
#include "tests/support/temp_folder.h"

#include <regex>
#include <string>

#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

namespace filiform {
namespace {

std::string found(const std::string& file, const std::string& pattern) {
  std::smatch match;
  const std::string text = test::readBytes(test::inSource(file));
  return std::regex_search(text, match, std::regex(pattern)) ? match.str(1) : "nothing in " + file;
}

TEST(Version, IsStatedAlikeEverywhere) {
  const std::string number = found("CMakeLists.txt", R"(project\(filiform VERSION ([0-9.]+) )");
  const std::string printed = test::runFiliform({"--version"}).out;
  const bool developed = printed == "filiform " + number + "-dev\n";
  EXPECT_TRUE(developed || printed == "filiform " + number + "\n") << printed;
  EXPECT_EQ(nlohmann::json::parse(test::runFiliform({"--json-usage"}).out).at("version"),
            number + (developed ? "-dev" : ""));
  EXPECT_EQ(found("tools/python/pyproject.toml", "version = \"(.*)\""), number + (developed ? ".dev0" : ""));
  EXPECT_EQ(found("tools/package/data/filiform.metainfo.xml", "<release version=\"([^\"]*)\""),
            number + (developed ? "~dev" : ""));
  EXPECT_EQ(found(".github/CHANGELOG.md", "\n## ([0-9a-z.-]*)"), number + (developed ? "-dev" : ""));
  EXPECT_EQ(found(".github/CITATION.cff", "\nversion: (.*)"), number + (developed ? "-dev" : ""));
  for (const char* header : {"index/version.h", "tools/c/filiform.h"})
    EXPECT_EQ(found(header, "VERSION_MAJOR ([0-9]+)") + "." + found(header, "VERSION_MINOR ([0-9]+)") + "." +
                  found(header, "VERSION_PATCH ([0-9]+)"),
              number)
        << header;
  EXPECT_EQ(found("README.md", "\"filiform ([0-9a-z.-]*), navigation"), number + (developed ? "-dev" : ""));
}

}  // namespace
}  // namespace filiform
