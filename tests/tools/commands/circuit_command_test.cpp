// Circuits and H5 morphologies as a user ingests them: figures against an independent reading, and bad input.
#include "index/attributes/cell_attributes.h"
#include "index/set/tile_set.h"
#include "tests/support/process.h"
#include "tests/support/scenes/circuit_figures.h"
#include "tests/support/scenes/small_circuit.h"
#include "tests/support/temp_folder.h"

#include <array>
#include <filesystem>
#include <map>
#include <string>
#include <utility>
#include <vector>

#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

namespace filiform {
namespace {

namespace fs = std::filesystem;
using test::expectFigures;
using test::Figures;
using test::figuresOf;
using test::figuresOfSet;
using test::ingestFine;
using test::Outcome;
using test::runFiliform;
using test::SmallCircuit;
using test::TempFolder;
using test::writePlaces;

class CircuitCommand : public ::testing::Test {
 protected:
  static void SetUpTestSuite() {
    folder_ = new TempFolder();
    circuit_ = new std::string(*folder_ / "circuit");
    const Outcome made = runFiliform({"synth", *circuit_, "--format", "sonata", "--cells", "24", "--library", "8"});
    ASSERT_EQ(made.exit_code, 0) << made.err;
    set_ = new std::string(*folder_ / "circuit.fil");
    const Outcome read = runFiliform({"ingest", config(), "-o", *set_});
    ASSERT_EQ(read.exit_code, 0) << read.err;
    report_ = new std::string(read.out);
  }
  static void TearDownTestSuite() {
    delete folder_;
    delete circuit_;
    delete set_;
    delete report_;
  }
  static std::string config() { return *circuit_ + "/circuit_config.json"; }
  static std::string nodes() { return *circuit_ + "/column/nodes.h5"; }
  static std::string container() { return *circuit_ + "/morphologies/merged-morphologies.h5"; }

  static TempFolder* folder_;
  static std::string *circuit_, *set_, *report_;
};
TempFolder* CircuitCommand::folder_ = nullptr;
std::string* CircuitCommand::circuit_ = nullptr;
std::string* CircuitCommand::set_ = nullptr;
std::string* CircuitCommand::report_ = nullptr;

TEST_F(CircuitCommand, TheMadeUpCircuitHasTheFiguresOfAnIndependentReading) {
  const nlohmann::json figures = figuresOf(config());
  if (figures.is_null()) GTEST_SKIP() << "needs python3-h5py and python3-numpy";
  const std::string set = *folder_ / "fine.fil";
  const Outcome made = ingestFine({config()}, set);
  ASSERT_EQ(made.exit_code, 0) << made.err;
  expectFigures(set, figures);
  EXPECT_EQ(figures["cells"], 24);
  EXPECT_NEAR(figures["mean_y"], 1, 1e-9);
}

TEST_F(CircuitCommand, SaysWhatBecameOfEachPopulation) {
  EXPECT_NE(
      report_->find("population column (biophysical): 24 nodes, 24 placed, 0 without a morphology; mean direction "
                    "of local +y (0.000, 1.000, 0.000), length 1.00000"),
      std::string::npos)
      << *report_;
  EXPECT_NE(report_->find("population input (virtual): 20 nodes, 0 placed, 20 without a morphology"), std::string::npos)
      << *report_;
  EXPECT_NE(report_->find("SOMA_LINK"), std::string::npos) << *report_;
  EXPECT_NE(report_->find("places 8 morphologies 24 times"), std::string::npos) << *report_;
}

TEST_F(CircuitCommand, TheSameSeedGivesTheSameBytes) {
  const std::string again = *folder_ / "again";
  ASSERT_EQ(runFiliform({"synth", again, "--format", "sonata", "--cells", "24", "--library", "8"}).exit_code, 0);
  for (const char* const file :
       {"circuit_config.json", "column/nodes.h5", "input/nodes.h5", "morphologies/merged-morphologies.h5"})
    EXPECT_EQ(test::readBytes(again + "/" + file), test::readBytes(*circuit_ + "/" + file)) << file;
}

TEST_F(CircuitCommand, CellsShowAndSelectByAttributes) {
  const Outcome all = runFiliform({"cells", *set_, "--json"});
  ASSERT_EQ(all.exit_code, 0) << all.err;
  std::size_t of_layer_5 = 0, named = 0;
  for (const nlohmann::json& cell : nlohmann::json::parse(all.out)) {
    const nlohmann::json& attributes = cell.at("attributes");
    EXPECT_EQ(attributes.at("population"), "column");
    EXPECT_EQ(cell.at("name"), "column/" + std::to_string(attributes.at("node_id").get<int>()));
    for (const char* const key : {"layer", "mtype", "morphology", "synapse_class", "x", "y", "z"})
      EXPECT_TRUE(attributes.contains(key)) << key;
    EXPECT_FALSE(attributes.contains("orientation_w"));
    of_layer_5 += attributes.at("layer") == 5;
    ++named;
  }
  EXPECT_EQ(named, 24u);
  const Outcome some = runFiliform({"cells", *set_, "--json", "--where", "layer=5"});
  ASSERT_EQ(some.exit_code, 0) << some.err;
  EXPECT_EQ(nlohmann::json::parse(some.out).size(), of_layer_5);
  EXPECT_GT(of_layer_5, 0u);
  const Outcome table = runFiliform({"cells", *set_, "--tsv", "--where", "mtype=L5_*"});
  EXPECT_NE(table.out.find("\tlayer\tmodel_type\tmorph_class\tmorphology\tmtype\t"), std::string::npos) << table.out;
  EXPECT_NE(table.out.find("\tL5_"), std::string::npos);
  EXPECT_EQ(table.out.find("\tL4_"), std::string::npos);
}

TEST_F(CircuitCommand, WrongConditionsAreRefused) {
  for (const auto& [condition, words] : std::vector<std::pair<std::string, std::string>>{
           {"mtype", "NAME=VALUE"}, {"layr=5", "layer"}, {"mtype<3", "text"}, {"layer>x", "NAME<NUMBER"}}) {
    const Outcome outcome = runFiliform({"cells", *set_, "--where", condition});
    EXPECT_EQ(outcome.exit_code, 2) << condition;
    EXPECT_TRUE(outcome.oneLineOnStderr()) << outcome.err;
    EXPECT_NE(outcome.err.find(words), std::string::npos) << outcome.err;
  }
}

TEST_F(CircuitCommand, NodesWithAContainerGiveTheSameCells) {
  const std::string set = *folder_ / "nodes.fil";
  const Outcome made = runFiliform({"ingest", nodes(), "--morphologies", container(), "-o", set});
  ASSERT_EQ(made.exit_code, 0) << made.err;
  const Figures a = figuresOfSet(set), b = figuresOfSet(*set_);
  EXPECT_EQ(a.cells, b.cells);
  EXPECT_EQ(a.segments, b.segments);
  EXPECT_EQ(a.lo_um, b.lo_um);
  EXPECT_EQ(a.hi_um, b.hi_um);
}

TEST_F(CircuitCommand, AContainerIsAnInputOfItsOwn) {
  const std::string set = *folder_ / "library.fil";
  const Outcome made = runFiliform({"ingest", container(), "-o", set});
  ASSERT_EQ(made.exit_code, 0) << made.err;
  EXPECT_EQ(TileSet::open(set)->counts().cells, 8u);
  EXPECT_TRUE(TileSet::open(set)->findCell("cell_00003"));
  const Outcome check = runFiliform({"check", container(), "--tsv", "--strict"});
  EXPECT_EQ(check.exit_code, 0) << check.out << check.err;  // notes are no warnings
  EXPECT_NE(check.out.find("REPEATED_POINT:"), std::string::npos);
  EXPECT_NE(check.out.find("SOMA_CONTOUR:8,SOMA_LINK:"), std::string::npos) << check.out;
}

TEST_F(CircuitCommand, SomaLinksAreCountedAndCanBeLeftOut) {
  const std::string with = *folder_ / "with.fil", without = *folder_ / "without.fil";
  ASSERT_EQ(runFiliform({"ingest", container(), "-o", with, "--no-levels"}).exit_code, 0);
  ASSERT_EQ(runFiliform({"ingest", container(), "-o", without, "--no-levels", "--no-soma-links"}).exit_code, 0);
  const Outcome check = runFiliform({"check", container(), "--json"});
  const std::uint64_t links = nlohmann::json::parse(check.out).at("codes").at("SOMA_LINK");
  EXPECT_GT(links, 8u);
  EXPECT_EQ(TileSet::open(with)->counts().segments, TileSet::open(without)->counts().segments + links);
  EXPECT_EQ(TileSet::open(with)->counts().roots, 8u);
  EXPECT_EQ(TileSet::open(without)->counts().roots, 8u + links);
}

TEST_F(CircuitCommand, APictureIsColouredByLayerWithALegend) {
  const std::string plain = *folder_ / "plain.png", coloured = *folder_ / "layer.png";
  const std::vector<std::string> common{"--size", "320x240", "--json"};
  const auto render = [&](std::vector<std::string> arguments) {
    arguments.insert(arguments.begin(), {"render", *set_});
    arguments.insert(arguments.end(), common.begin(), common.end());
    // The OpenGL driver leaks (see tests/CMakeLists.txt).
    return test::runFiliformInShell("ASAN_OPTIONS=detect_leaks=0:strict_string_checks=1 exec \"$@\"", arguments);
  };
  const Outcome drawn = render({"-o", coloured, "--colour-by", "layer", "--where", "layer>=4"});
  if (drawn.exit_code != 0 && drawn.err.find("OpenGL") != std::string::npos) GTEST_SKIP() << drawn.err;
  ASSERT_EQ(drawn.exit_code, 0) << drawn.err;
  const nlohmann::json legend = nlohmann::json::parse(drawn.out).at("legend");
  ASSERT_GE(legend.size(), 2u);
  std::uint64_t cells = 0;
  std::map<std::string, int> colours;
  for (const nlohmann::json& entry : legend) {
    cells += entry.at("cells").get<std::uint64_t>();
    ++colours[entry.at("colour")];
    EXPECT_GE(std::stoi(entry.at("value").get<std::string>()), 4) << "the other layers are not coloured";
  }
  EXPECT_EQ(cells, nlohmann::json::parse(runFiliform({"cells", *set_, "--json", "--where", "layer>=4"}).out).size());
  EXPECT_EQ(render({"-o", plain, "--colour-by", "attribute:layer"}).exit_code, 0);
  EXPECT_EQ(colours.size(), legend.size());
  ASSERT_EQ(render({"-o", plain}).exit_code, 0);
  EXPECT_NE(test::readBytes(plain), test::readBytes(coloured));
  const Outcome unknown = render({"-o", plain, "--colour-by", "layr"});
  EXPECT_EQ(unknown.exit_code, 2);
  EXPECT_NE(unknown.err.find("layer, model_type"), std::string::npos) << unknown.err;
}

TEST_F(CircuitCommand, WhatIsNotPlacedIsCountedAndACircuitThatPlacesNothingIsRefused) {
  const auto checked = [](const std::string& name, const std::string& types) {
    const SmallCircuit circuit(*folder_ / name);
    test::writeBytes(*folder_ / (name + "/types.csv"), types);
    circuit.write([](Hdf5Writer& out) {
      out.integers("nodes/p/node_type_id", "i64", 1, std::vector<std::int64_t>{7, 8});
      writePlaces(out, 2);
    });
    return runFiliform({"check", circuit.config()});
  };
  const Outcome older = checked("older", "node_type_id morphology_file\n7 a.swc\n8 off.swc\n");
  EXPECT_EQ(older.exit_code, 0) << older.err;
  EXPECT_NE(older.out.find("2 nodes, 2 placed, 0 without a morphology"), std::string::npos) << older.out;
  const Outcome partly = checked("partly", "node_type_id morphology\n7 a\n8 A\n");
  EXPECT_NE(partly.out.find("2 nodes, 1 placed, 0 without a morphology, 1 whose morphology is missing"),
            std::string::npos)
      << partly.out;
  fs::create_directories(*folder_ / "broken");
  test::writeBytes(*folder_ / "broken/bad.swc", "");
  const Outcome broken = checked("broken", "node_type_id morphology\n7 a\n8 bad\n");
  EXPECT_NE(broken.out.find("2 nodes, 1 placed, 0 without a morphology, 1 whose morphology is refused"),
            std::string::npos)
      << broken.out;
  for (const auto& [types, reason] :
       {std::pair("node_type_id morphology\n7 A\n8 B\n", "the morphologies of 2 are missing, the first is A.swc"),
        {"node_type_id morphology_file\n7 C.asc\n8 B\n", "the morphologies of 2 are missing, the first is C.asc\n"},
        {"node_type_id kind\n7 a\n8 b\n", "none has a morphology (attribute morphology or morphology_file)"}}) {
    const Outcome none = checked("none", types);
    EXPECT_EQ(none.exit_code, 1) << none.out;
    EXPECT_TRUE(none.oneLineOnStderr()) << none.err;
    EXPECT_NE(none.err.find(std::string("circuit_config.json: places none of its 2 nodes: ") + reason),
              std::string::npos)
        << none.err;
  }
}

TEST_F(CircuitCommand, TypesAnglesNullAndRecentringFollowTheSpecification) {
  const SmallCircuit circuit(*folder_ / "types");
  circuit.write([](Hdf5Writer& out) {
    out.integers("nodes/p/node_type_id", "i64", 1, std::vector<std::int64_t>{7, 8, 9, 9});
    writePlaces(out, 4);
    out.integers("nodes/p/0/recenter", "i8", 1, std::vector<std::int64_t>{1, 1, 1, 0});
  });
  const std::string set = *folder_ / "types.fil";
  const Outcome made = runFiliform({"ingest", circuit.config(), "-o", set, "--no-levels"});
  ASSERT_EQ(made.exit_code, 0) << made.err;
  EXPECT_NE(made.out.find("4 nodes, 3 placed, 1 without a morphology"), std::string::npos) << made.out;
  EXPECT_NE(made.out.find("W_SOMA_OFFSET 1"), std::string::npos) << made.out;
  const auto opened = TileSet::open(set);
  const auto box = [&](const std::string& name) {
    const GridBox& bounds = opened->cell(opened->findCell(name).value()).bounds;
    return std::pair(opened->grid().toWorld(bounds.lo), opened->grid().toWorld(bounds.hi));
  };
  // Turned by a quarter about z: local +y points to -x.
  EXPECT_NEAR((box("p/0").first - Vector3d(-20, 0, 0)).norm(), 0, 1e-6);
  EXPECT_NEAR((box("p/0").second - Vector3d(0, 0, 0)).norm(), 0, 1e-6);
  EXPECT_NEAR((box("p/2").second - Vector3d(0, 10, 0)).norm(), 0, 1e-6);    // its soma is moved to the origin
  EXPECT_NEAR((box("p/3").second - Vector3d(100, 10, 0)).norm(), 0, 1e-6);  // recenter is 0
  const CellAttributes attributes(*opened);
  EXPECT_EQ(textOf(attributes.value(attributes.find("ei").value(), opened->findCell("p/0").value())), "e");
}

TEST_F(CircuitCommand, OldFilesWithGroupsAndPositionsAreRead) {
  const SmallCircuit circuit(*folder_ / "groups");
  circuit.write([](Hdf5Writer& out) {
    out.integers("nodes/p/node_type_id", "i64", 1, std::vector<std::int64_t>{9, 7, 9});
    out.integers("nodes/p/node_group_id", "u32", 1, std::vector<std::int64_t>{1, 0, 1});
    out.integers("nodes/p/node_group_index", "u32", 1, std::vector<std::int64_t>{0, 0, 1});
    out.reals("nodes/p/0/positions", "f64", 3, std::vector<double>{1, 2, 3});
    out.reals("nodes/p/1/positions", "f64", 3, std::vector<double>{10, 0, 0, 20, 0, 0});
    out.texts("nodes/p/1/only_here", {"first", "second"});
    out.texts("nodes/p/0/too_long", {"first", "second", "third"});
  });
  const std::string set = *folder_ / "groups.fil";
  const Outcome made = runFiliform({"ingest", circuit.config(), "-o", set, "--no-levels"});
  ASSERT_EQ(made.exit_code, 0) << made.err;
  const auto opened = TileSet::open(set);
  const CellAttributes attributes(*opened);
  const auto cell = [&](const std::string& name) { return opened->findCell(name).value(); };
  EXPECT_EQ(textOf(attributes.value(attributes.find("x").value(), cell("p/2"))), "20");
  EXPECT_EQ(textOf(attributes.value(attributes.find("x").value(), cell("p/1"))), "1");
  EXPECT_EQ(textOf(attributes.value(attributes.find("only_here").value(), cell("p/2"))), "second");
  EXPECT_EQ(textOf(attributes.value(attributes.find("only_here").value(), cell("p/1"))), "");
}

// Circuits of the Open Brain Institute hold layers as text.
TEST_F(CircuitCommand, NumbersThatAreHeldAsTextCompareAsNumbers) {
  const SmallCircuit circuit(*folder_ / "text");
  test::writeBytes(*folder_ / "text/types.csv", "node_type_id\n7\n");
  fs::copy_file(*folder_ / "text/a.swc", *folder_ / "text/12.swc");
  circuit.write([](Hdf5Writer& out) {
    out.integers("nodes/p/node_type_id", "i64", 1, std::vector<std::int64_t>{7, 7, 7});
    writePlaces(out, 3);
    out.texts("nodes/p/0/layer", {"6", "5", ""});
    out.texts("nodes/p/0/code", {"007", "1", "2"});
    out.texts("nodes/p/0/morphology", {"12", "12", "12"});
  });
  const std::string set = *folder_ / "text.fil";
  const Outcome made = ingestFine({circuit.config()}, set);
  ASSERT_EQ(made.exit_code, 0) << made.err;
  const Outcome deep = runFiliform({"cells", set, "--json", "--where", "layer>=5.5"});
  ASSERT_EQ(deep.exit_code, 0) << deep.err;
  const nlohmann::json cells = nlohmann::json::parse(deep.out);
  ASSERT_EQ(cells.size(), 1u);
  EXPECT_EQ(cells[0].at("attributes").at("layer"), 6);
  EXPECT_EQ(cells[0].at("attributes").at("code"), "007");
  EXPECT_EQ(cells[0].at("attributes").at("morphology"), "12");
}

TEST_F(CircuitCommand, VasculatureIsReadAsAGraph) {
  const std::string folder = *folder_ / "vessels";
  fs::create_directories(folder);
  test::writeBytes(folder + "/circuit_config.json",
                   R"({"networks":{"nodes":[{"nodes_file":"nodes.h5","populations":{"v":{"type":"vasculature"}}}]}})");
  {  // a square with a tail
    Hdf5Writer out(folder + "/nodes.h5");
    const std::vector<std::int64_t> start{0, 1, 2, 3, 0}, end{1, 2, 3, 0, 4};
    const std::vector<std::array<double, 3>> place{{0, 0, 0}, {10, 0, 0}, {10, 10, 0}, {0, 10, 0}, {-5, 0, 0}};
    out.integers("nodes/v/node_type_id", "i64", 1, std::vector<std::int64_t>(5, -1));
    for (const bool first : {true, false}) {
      const std::string side = std::string("nodes/v/0/") + (first ? "start" : "end");
      const auto& ids = first ? start : end;
      out.integers(side + "_node", "i64", 1, ids);
      for (std::size_t axis = 0; axis < 3; ++axis) {
        std::vector<double> values;
        for (const std::int64_t id : ids) values.push_back(place[static_cast<std::size_t>(id)][axis]);
        out.reals(side + "_" + "xyz"[axis], "f32", 1, values);
      }
      out.reals(side + "_diameter", "f32", 1, std::vector<double>(5, 4));
    }
    out.finish();
  }
  const std::string set = *folder_ / "vessels.fil";
  const Outcome made = runFiliform({"ingest", folder + "/circuit_config.json", "-o", set});
  ASSERT_EQ(made.exit_code, 0) << made.err;
  const Outcome cells = runFiliform({"cells", set, "--json"});
  const nlohmann::json cell = nlohmann::json::parse(cells.out).at(0);
  EXPECT_EQ(cell.at("name"), "v");
  EXPECT_EQ(cell.at("loops"), 1);
  EXPECT_EQ(cell.at("segments"), 5);
  EXPECT_DOUBLE_EQ(cell.at("length_um"), 45);
}

TEST_F(CircuitCommand, DoubtfulRotationsAreSaid) {
  const SmallCircuit circuit(*folder_ / "doubt");
  circuit.write([](Hdf5Writer& out) {
    out.integers("nodes/p/node_type_id", "i64", 1, std::vector<std::int64_t>(40, 9));
    writePlaces(out, 40);
    std::vector<double> angles;
    for (int i = 0; i < 40; ++i) angles.push_back(2 * 3.14159265358979 * i / 40);
    out.reals("nodes/p/0/rotation_angle_zaxis", "f64", 1, angles);
  });
  const Outcome check = runFiliform({"check", circuit.config()});
  EXPECT_EQ(check.exit_code, 0) << check.err;
  EXPECT_NE(check.err.find("below 0.5"), std::string::npos) << check.err;
  EXPECT_NE(check.out.find("mean direction of local +y (0.000, 0.000, 0.000)"), std::string::npos) << check.out;
}

}  // namespace
}  // namespace filiform
