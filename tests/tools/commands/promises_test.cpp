// What the text of an option promises is true: reads `--json-usage` and tries each command.
#include "tests/support/run_here.h"
#include "tests/support/sanitized.h"
#include "tests/support/temp_folder.h"
#include "tests/support/variable.h"

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <functional>
#include <sstream>
#include <string>
#include <vector>

#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

namespace filiform {
namespace {

namespace fs = std::filesystem;
using Json = nlohmann::json;
using Given = std::vector<std::string>;
using test::Outcome;

class Promises : public ::testing::Test {
 protected:
  Promises() {
    fs::current_path(folder_.path());
    test::makeInputs();
    usage_ = Json::parse(test::runHere({"--json-usage"}).out);
  }
  ~Promises() override { fs::current_path(before_); }

  // For each option with a value, of the commands that end by themselves, and of `serve`, `view` and `render` if the
  // option is refused before they begin.
  void forEachOption(const std::function<void(const Given& good, const Json& option, const std::string& name)>& use,
                     bool refused = false) const {
    std::vector<Given> lines = test::goodCommands();
    const std::vector<Given> endless{{"serve", "set.fil"}, {"view", "set.fil"}, {"render", "set.fil", "-o", "o.png"}};
    if (refused) lines.insert(lines.end(), endless.begin(), endless.end());
    for (const Given& good : lines)
      for (const Json& command : usage_.at("commands")) {
        if (command.at("name") != good[0]) continue;
        for (const Json& option : command.at("options")) {
          const Json& names = option.at("names");
          if (std::any_of(names.begin(), names.end(), [&](const Json& given) {
                return std::find(good.begin(), good.end(), given.get<std::string>()) != good.end();
              }))
            continue;  // given already
          const std::string name = names[names.size() > 1 && names[0].get<std::string>().size() == 2 ? 1 : 0];
          SCOPED_TRACE(good[0] + " " + name);
          use(good, option, name);
          for (const char* made : {"new.fil", "new.zip", "out.swc"}) fs::remove_all(made);
        }
      }
  }
  static Given with(Given line, const Given& more) {
    line.insert(line.end(), more.begin(), more.end());
    return line;
  }
  static std::string plain(double value) {
    std::ostringstream text;
    text.precision(17);
    text << value;
    return text.str();
  }
  // A value that the option takes, or nothing certain.
  static std::string valueOf(const Json& option) {
    if (!option.at("default").is_null()) return option["default"];
    if (!option.at("range").is_null())
      return plain(option["range"][0].is_null() ? 1.0 : option["range"][0].get<double>());
    return "1";
  }
  static bool isNumber(const Json& option) {
    const Json& value = option.at("value");
    return !option.at("range").is_null() || value == "UINT" || value == "INT" || value == "FLOAT";
  }
  static void expectRefusal(const Outcome& outcome, const std::vector<std::string>& says) {
    EXPECT_EQ(outcome.exit_code, 2) << outcome.err;
    EXPECT_TRUE(outcome.oneLineOnStderr()) << outcome.err;
    for (const std::string& text : says) EXPECT_NE(outcome.err.find(text), std::string::npos) << text << outcome.err;
  }

  fs::path before_ = fs::current_path();
  test::TempFolder folder_;
  Json usage_;
};

TEST_F(Promises, RepeatableOptionsMayBeRepeatedAndNoOthers) {
  std::size_t repeatable = 0;
  for (const Json& command : usage_.at("commands"))
    for (const Json& option : command.at("options")) {
      if (command.contains("program")) continue;  // of filiform-lab, which takes lists
      SCOPED_TRACE(command.at("name").get<std::string>() + option.at("names").dump());
      const bool says = option.at("description").get<std::string>().find("repeatable") != std::string::npos;
      EXPECT_EQ(says, option.at("repeatable").get<bool>());
      repeatable += says ? 1 : 0;
    }
  EXPECT_GE(repeatable, 5u) << "cells --where, render --where, ingest --remove, serve --origin and --host";
  forEachOption(
      [&](const Given& good, const Json& option, const std::string& name) {
        if (option.at("values") != 1 || option.at("repeatable") == true || name == "--record-sessions") return;
        expectRefusal(test::runHere(with(good, {name, valueOf(option), name, valueOf(option)})), {name, "once"});
      },
      true);
}

TEST_F(Promises, EveryRepetitionCounts) {
  const auto cells = [](const Given& conditions) {
    Given line{"cells", "set.fil", "--json"};
    for (const std::string& condition : conditions) line.insert(line.end(), {"--where", condition});
    const Outcome outcome = test::runHere(line);
    EXPECT_EQ(outcome.exit_code, 0) << outcome.err;
    return Json::parse(outcome.out).size();
  };
  EXPECT_EQ(cells({"layer=4", "cell_type=Tm3"}), 1u);
  EXPECT_EQ(cells({"layer=4", "cell_type=Tm4"}), 0u);
  EXPECT_EQ(cells({"layer=5", "cell_type=Tm3"}), 0u);
  test::writeBytes("a.swc", "1 1 0 0 0 5 -1\n2 3 10 0 0 1 1\n");
  test::writeBytes("b.swc", "1 1 0 9 0 5 -1\n2 3 10 9 0 1 1\n");
  EXPECT_EQ(test::runHere({"ingest", "a.swc", "b.swc", "cell.swc", "-o", "three.fil"}).exit_code, 0);
  const Outcome removed = test::runHere({"ingest", "--remove", "a", "--remove", "b", "-o", "three.fil"});
  EXPECT_EQ(removed.exit_code, 0) << removed.err;
  EXPECT_EQ(Json::parse(test::runHere({"cells", "three.fil", "--json"}).out).size(), 1u);
}

TEST_F(Promises, ADefaultIsWhatCountsWithoutTheOption) {
  std::size_t tried = 0;
  forEachOption([&](const Given& good, const Json& option, const std::string& name) {
    if (option.at("default").is_null() || !option.at("needs").empty() || good[0] == "devices") return;
    const Outcome usual = test::runHere(good);
    for (const char* made : {"new.fil", "new.zip", "out.swc"}) fs::remove_all(made);
    const Outcome given = test::runHere(with(good, {name, option["default"].get<std::string>()}));
    EXPECT_EQ(given.exit_code, usual.exit_code) << given.err;
    EXPECT_EQ(given.out, usual.out);
    EXPECT_EQ(given.err, usual.err);
    ++tried;
  });
  EXPECT_GT(tried, 30u);
}

TEST_F(Promises, NumbersHaveTheirRange) {
  std::size_t ranges = 0;
  forEachOption(
      [&](const Given& good, const Json& option, const std::string& name) {
        if (!isNumber(option) || option.at("values") != 1) return;
        expectRefusal(test::runHere(with(good, {name, "zebra"})), {name, "zebra", "give "});
        if (option.at("range").is_null()) return;
        ++ranges;
        const Json &least = option["range"][0], &most = option["range"][1];
        const auto expectOutside = [&](double value) {
          expectRefusal(test::runHere(with(good, {name, plain(value)})), {name + " " + plain(value) + ": give "});
        };
        if (!least.is_null()) expectOutside(least.get<double>() - std::max(1.0, std::abs(least.get<double>())));
        if (!most.is_null()) expectOutside(most.get<double>() + std::max(1.0, std::abs(most.get<double>())));
      },
      true);
  EXPECT_GT(ranges, 15u);
}

TEST_F(Promises, EndsOfARangeAreInIt) {
  forEachOption([&](const Given& good, const Json& option, const std::string& name) {
    if (option.at("range").is_null() || name == "--threads" || name == "--cells") return;
    for (const Json& end : option["range"]) {
      if (end.is_null()) continue;
      const Outcome outcome = test::runHere(with(good, {name, plain(end.get<double>())}));
      EXPECT_EQ(outcome.err.find(name + " " + plain(end.get<double>()) + ": give "), std::string::npos) << outcome.err;
    }
  });
}

TEST_F(Promises, ANumberThatIsNoCountStatesItsUnit) {
  const Given units{"um",        "N/m",    "m/s",    " ms",    "second",   "ticks a second", "Hz",
                    "px",        "pixel",  "degree", "factor", "multiple", "times",          "long after",
                    "thickness", "newton", " N",     "mV",     "%",        "distance of",    " days"};
  for (const Json& command : usage_.at("commands"))
    for (const Json& option : command.at("options")) {
      if (option.at("value") != "FLOAT") continue;
      const auto description = option.at("description").get<std::string>();
      const auto name = option.at("names").back().get<std::string>();
      const bool has = std::any_of(units.begin(), units.end(), [&](const std::string& unit) {
        return (name + " " + description).find(unit) != std::string::npos;
      });
      EXPECT_TRUE(has) << command.at("name") << " " << name << ": " << description;
    }
}

TEST_F(Promises, OptionsThatExcludeEachOtherAreRefusedTogether) {
  std::size_t tried = 0;
  forEachOption(
      [&](const Given& good, const Json& option, const std::string& name) {
        for (const Json& other : option.at("excludes")) {
          if (option.at("values") != 0 || other == "--box" || other == "--ray") continue;  // these take six values
          Given both{name, other};
          for (const Json& command : usage_.at("commands"))
            for (const Json& named : command.at("options"))
              if (command.at("name") == good[0] && named.at("names").back() == other && named.at("values") == 1)
                both.push_back(valueOf(named));
          expectRefusal(test::runHere(with(good, both)), {both[0], both[1]});
          ++tried;
        }
      },
      true);
  EXPECT_GT(tried, 3u);
}

TEST_F(Promises, ChoicesAreThoseOfTheText) {
  struct Choice {
    Given good;
    std::string option;
    Given choices;
  };
  const Given nearest{"nearest", "set.fil", "1", "2", "3"}, navigate{"navigate", "set.fil", "--seconds", "0.01"};
  const std::vector<Choice> all{
      {nearest, "--engine", {"packed", "cgal"}},
      {navigate, "--method", {"basic", "shading", "force", "force-listing", "climb"}},
      {navigate, "--hand", {"loose", "medium", "firm"}},
      {navigate, "--passivity", {"auto", "on", "off"}},
      {navigate, "--prefetch", {"none", "distance", "structure"}},
      {{"export", "set.fil", "--all", "-o", "all.zip"}, "--format", {"swc", "edges", "obj", "vtk"}},
      {{"ingest", "cell.swc", "-o", "y.fil", "--force"}, "--version", {"cng", "source", "both"}},
      {{"synth", "new.zip", "--cells", "1"}, "--kind", {"column", "traces", "fan"}},
      {{"verify", "set.fil"}, "--progress", {"auto", "json", "none"}}};
  for (const Choice& choice : all) {
    SCOPED_TRACE(choice.good[0] + choice.option);
    std::string description;
    for (const Json& command : usage_.at("commands"))
      for (const Json& option : command.at("options"))
        if (command.at("name") == choice.good[0] && option.at("names").back() == choice.option)
          description = option.at("description").get<std::string>();
    const Outcome refused = test::runHere(with(choice.good, {choice.option, "zebra"}));
    expectRefusal(refused, {"zebra"});
    for (const std::string& value : choice.choices) {
      EXPECT_NE(description.find(value), std::string::npos) << value << ": " << description;
      EXPECT_NE(refused.err.find(value), std::string::npos) << value << ": " << refused.err;
      const Outcome taken = test::runHere(with(choice.good, {choice.option, value}));
      EXPECT_EQ(taken.exit_code, 0) << value << taken.err;
      fs::remove("all.zip");
    }
  }
}

TEST_F(Promises, AConditionMayHaveBlanksAndTwoEqualSigns) {
  const auto cells = [](const std::string& condition) {
    const Outcome outcome = test::runHere({"cells", "set.fil", "--json", "--where", condition});
    return outcome.exit_code == 0 ? std::to_string(Json::parse(outcome.out).size()) : outcome.err;
  };
  for (const char* one : {"cell_type=Tm3", "cell_type = Tm3", "cell_type==Tm3", "cell_type == Tm3", " cell_type=Tm3 ",
                          "layer>=4", "layer >= 4", "layer < 4.5", "cell_type!=Tm4", "cell_type != Tm4"})
    EXPECT_EQ(cells(one), "1") << one;
  for (const char* none : {"cell_type == Tm4", "layer > 4", "cell_type != Tm3"}) EXPECT_EQ(cells(none), "0") << none;
  for (const char* wrong : {"cell_type=<Tm3", "layer=>4", "layer=<4", "cell_type===Tm3", "cell_type!==Tm3", "cell_type",
                            "= 4", "layer<", "layer!4", "layer<>4"})
    EXPECT_NE(cells(wrong).find("expected NAME=VALUE"), std::string::npos) << wrong << cells(wrong);
}

TEST_F(Promises, ANameIsFoundInAnyLetterCase) {
  for (const char* name : {"cell", "CELL", "Cell", "C*", "[B-D]ELL"})
    EXPECT_EQ(Json::parse(test::runHere({"cells", "set.fil", "--json", "--name", name}).out).size(), 1u) << name;
  EXPECT_EQ(test::runHere({"export", "set.fil", "--cell", "CELL", "-o", "out.swc"}).exit_code, 0);
}

TEST_F(Promises, AnOptionWithoutEffectIsRefused) {
  const Given box{"nearest", "set.fil", "--box", "0", "0", "0", "9", "9", "9"};
  const Given ray{"nearest", "set.fil", "--ray", "0", "0", "9", "0", "0", "-1"};
  for (const Given& option : {Given{"--k", "3"}, {"--radius", "3"}, {"--epsilon", "1"}, {"--approximate"}})
    expectRefusal(test::runHere(with(box, option)), {option[0], "cannot be given with", "--box"});
  for (const Given& option : {Given{"--radius", "3"}, {"--epsilon", "1"}, {"--approximate"}})
    expectRefusal(test::runHere(with(ray, option)), {option[0], "cannot be given with", "--ray"});
  EXPECT_EQ(test::runHere(with(ray, {"--k", "3", "--tolerance", "2", "--slope", "1"})).exit_code, 0);
  expectRefusal(test::runHere({"view", "set.fil", "--web", "--device", "null", "--state", "s"}),
                {"--web", "leave out", "--device", "--state"});
  std::size_t tried = 0;
  forEachOption(
      [&](const Given& good, const Json& option, const std::string& name) {
        for (const Json& other : option.at("needs")) {
          expectRefusal(test::runHere(with(good, {name, valueOf(option)})),
                        {name + " needs ", other.get<std::string>()});
          ++tried;
        }
      },
      true);
  EXPECT_GE(tried, 5u) << "of nearest, info and render";
}

TEST_F(Promises, AnUnknownOptionSuggestsOnlyWhatIsNear) {
  const std::string said = test::runHere({"cells", "set.fil", "--cell", "x"}).err;
  EXPECT_EQ(said, "filiform: unknown option '--cell'; 'filiform cells --help' lists the options\n");
  EXPECT_NE(test::runHere({"cells", "set.fil", "--nam", "x"}).err.find("did you mean '--name'?"), std::string::npos);
}

TEST_F(Promises, CountsOfOneAreSingular) {
  EXPECT_EQ(test::runHere({"check", "cell.swc"}).out,
            "1 input: 1 accepted, 0 with warnings, 0 refused; 4 samples, 3 segments kept\n");
  const Outcome made = test::runHere({"ingest", "cell.swc", "-o", "one.fil"});
  EXPECT_NE(made.out.find("1 cell, 4 samples, 3 segments in 1 tile, "), std::string::npos) << made.out;
  const Outcome points = [] {
    test::writeBytes("p.txt", "7\n");
    return test::runHere({"nearest", "set.fil", "--points", "p.txt"});
  }();
  EXPECT_NE(points.err.find("p.txt:1: 1 field; give three"), std::string::npos) << points.err;
}

TEST_F(Promises, TheFirstWrongCoordinateIsNamed) {
  expectRefusal(test::runHere({"nearest", "set.fil", "a", "b", "c"}), {"x is 'a'"});
  test::writeBytes("p.txt", "x y z\n");
  expectRefusal(test::runHere({"nearest", "set.fil", "--points", "p.txt"}), {"p.txt:1: x is 'x'"});
  test::writeBytes("p.txt",
                   "\xef\xbb\xbf"
                   "1 2 3\n");
  EXPECT_EQ(test::runHere({"nearest", "set.fil", "--points", "p.txt"}).exit_code, 0) << "a byte-order mark";
}

TEST_F(Promises, ASetIsNoInputOfCheck) {
  const Outcome outcome = test::runHere({"check", "set.fil"});
  EXPECT_EQ(outcome.exit_code, 1);
  EXPECT_NE(outcome.err.find("set.fil: is a tile set already"), std::string::npos) << outcome.err;
}

}  // namespace
}  // namespace filiform
