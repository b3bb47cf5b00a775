#include "tools/lab/evaluate/evaluation.h"

#include "index/errors.h"
#include "tests/lab/evaluation_cells.h"
#include "tests/support/process.h"
#include "tests/support/temp_folder.h"
#include "tools/lab/evaluate/trials/scenes.h"
#include "tools/lab/evaluate/trials/trial.h"
#include "tools/lab/shared/page.h"
#include "tools/lab/shared/parallel.h"
#include "tools/synthetic/synthetic.h"

#include <atomic>
#include <cmath>
#include <filesystem>
#include <random>
#include <stdexcept>

#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

namespace filiform::tools {
namespace {

using test::readBytes;

std::string evaluateInto(const std::string& folder, unsigned threads) {
  std::filesystem::create_directories(folder);
  SyntheticOptions synthetic;
  synthetic.cells = 3;
  SyntheticCells cells(synthetic);
  EvaluationOptions options;
  options.out = folder;
  options.quick = true;
  options.routes = 1;
  options.threads = threads;
  options.methods = {"force", "climb", "nearest"};
  options.zooms_um = {1000};
  return evaluate(cells, options);
}

// One test for all output files, because every run takes a second.
TEST(Evaluation, WritesTheSameBytesWhateverTheThreadsAndAPageThatNeedsNothingElse) {
  const test::TempFolder folder;
  evaluateInto(folder / "one", 1);
  evaluateInto(folder / "two", 2);
  for (const char* file : {"trials.csv", "hold.csv", "cells.csv"}) {
    const std::string one = readBytes(folder / "one/" + file);
    EXPECT_GT(one.size(), 50u) << file;
    EXPECT_TRUE(one == readBytes(folder / "two/" + file)) << file;
  }
  const std::string page = readBytes(folder / "two/evaluate.html");
  EXPECT_NE(page.find("data:image/png;base64,iVBORw0KGgo"), std::string::npos);
  EXPECT_EQ(page.find("://"), std::string::npos);
  EXPECT_EQ(page.find("src=\"scene"), std::string::npos);
  const auto evaluated = nlohmann::json::parse(readBytes(folder / "two/evaluate.json"));
  for (const char* table :
       {"goals", "scene_time", "scene_force", "scene_ratios", "scene_hands", "fan", "fan_completed", "main_medium",
        "held_out_medium", "paired", "hold", "ablation_climb", "stress", "parameters", "machine"})
    EXPECT_TRUE(evaluated["tables"].contains(table)) << table;
}

TEST(Evaluation, RunsTheScenesThatAreNamedAndNoMore) {
  const test::TempFolder folder;
  const test::Outcome outcome = test::runFiliform(
      {"evaluate", "--out", folder / "out", "--scenes", "meander,scene2", "--methods", "climb,nearest"});
  EXPECT_EQ(outcome.exit_code, 0) << outcome.err;
  for (const char* row :
       {"| meander | climb | 20 of 20 |", "| meander | nearest | 20 of 20 |", "| scene 2 | climb | 20 of 20 |"})
    EXPECT_NE(outcome.out.find(row), std::string::npos) << row << '\n' << outcome.out;
  EXPECT_EQ(outcome.out.find("elbows"), std::string::npos);
}

TEST(Evaluation, ProgramRefusesWhatMakesNoSense) {
  const test::TempFolder folder;
  const auto refuses = [&](std::vector<std::string> arguments, int code, const std::string& says) {
    arguments.insert(arguments.begin(), {"evaluate", "--quick", "--out", folder / "out"});
    const test::Outcome outcome = test::runFiliform(arguments);
    EXPECT_EQ(outcome.exit_code, code) << outcome.err;
    EXPECT_TRUE(outcome.oneLineOnStderr()) << outcome.err;
    EXPECT_NE(outcome.err.find(says), std::string::npos) << outcome.err;
    EXPECT_FALSE(std::filesystem::exists(folder / "out"));
  };
  refuses({"--methods", "magic"}, 2, "magic");
  refuses({"--zooms", "0"}, 2, "zoom");
  refuses({"--scenes", "heap"}, 2, "no such scene 'heap'");
  refuses({"--corpus", folder / "none"}, 3, "none");
  test::writeBytes(folder / "tiny.swc", "1 1 0 0 0 1 -1\n2 3 1 0 0 1 1\n");
  refuses({"--corpus", folder / "tiny.swc"}, 1, "40 um");
  test::writeBytes(folder / "page.swc", "<html>\n");
  refuses({"--corpus", folder / "page.swc"}, 2, "--corpus page.swc: no usable neuron");
}

TEST(Trial, SameSetupSameFigures) {
  const std::vector<CorpusCell> scenes = evaluationScenes();
  TrialCell cell(scenes[1].cell);
  const CellGraph& graph = cell.graph();
  const DrawnRoute& drawn = scenes[1].routes.front();
  const Route route(0, graph.grid, graph.positions, graph.parents, drawn.first, drawn.last);
  for (const std::string& method : trialMethods()) {
    SCOPED_TRACE(method);
    TrialSetup setup;
    setup.method = method;
    setup.measure_time = true;  // checks that the solver's second run ends where the first did
    TrialTrace trace;
    const TrialResult a = runTrial(cell, route, setup, nullptr, &trace), b = runTrial(cell, route, setup);
    EXPECT_TRUE(a.finite);
    EXPECT_EQ(a.ticks, trace.force_N.size());
    EXPECT_EQ(a.ticks, b.ticks);
    EXPECT_EQ(a.force_integral_Ns, b.force_integral_Ns);
    EXPECT_EQ(a.visited, b.visited);
    EXPECT_EQ(a.skip_um, b.skip_um);
    EXPECT_GT(a.solver_ns, 0);
    setup.seed = 2;
    EXPECT_NE(runTrial(cell, route, setup).force_integral_Ns, a.force_integral_Ns);
  }
}

TEST(Trial, TheOracleIsNeverFartherThanAnyMethod) {
  // The same hand, held still: at the end no method is nearer than the nearest point.
  TrialCell cell(test::randomTree(3, 400));
  TrialSetup setup;
  setup.method = "nearest";
  const std::unique_ptr<ProxySolver> oracle = makeTrialSolver(cell, setup);
  setup.method = "force";
  const std::unique_ptr<ProxySolver> other = makeTrialSolver(cell, setup);
  const ProxyPlace start = cell.placeAt(1, 0.5);
  oracle->setPlace(start);
  other->setPlace(start);
  std::mt19937_64 random(1);
  SolverStep step;
  for (int i = 0; i < 500; ++i) {
    const auto uniform = [&] { return 60 * (static_cast<double>(random() >> 11) * 0x1p-53 - 0.5); };
    ProbeState probe;
    probe.h_W = Vector3d(uniform(), uniform(), uniform());
    const Vector3d& h_W = probe.h_W;
    oracle->advance(cell.view(), probe, step);
    other->advance(cell.view(), probe, step);
    EXPECT_LE((oracle->place().p_W - h_W).norm(), (other->place().p_W - h_W).norm() + 1e-9);
    ASSERT_TRUE(oracle->place().valid());
  }
}

TEST(Trial, SinglePrecisionFarFromTheOriginIsFelt) {
  // At 1 m from the origin single precision has steps of 1/16 um, and the proxy moves in these steps.
  const Cell straight = test::cellOf({{0, 0, 0}, {100, 0, 0}, {200, 0, 0}}, {kNoParent, 0, 1});
  TrialSetup setup;
  setup.method = "basic";
  const auto integral = [&](bool single, double offset_um) {
    setup.round_probe = single;
    setup.treatment = {single, offset_um};
    TrialCell cell(straight, setup.treatment);
    const CellGraph& graph = cell.graph();
    return runTrial(cell, Route(0, graph.grid, graph.positions, graph.parents, 0, 2), setup).force_integral_Ns;
  };
  const double near = integral(false, 0);
  EXPECT_NEAR(integral(false, 1e6), near, 1e-9 * near);
  EXPECT_NEAR(integral(true, 0), near, 1e-4 * near);
  EXPECT_GT(std::abs(integral(true, 1e6) - near), 1e-7 * near);
}

TEST(ParallelFor, DoesEachPieceOnce) {
  std::vector<std::atomic<int>> done(1000);
  parallelFor(done.size(), 3, [&](std::size_t i) { ++done[i]; });
  for (const auto& count : done) EXPECT_EQ(count, 1);
}

TEST(ParallelFor, PassesOnWhatIsThrown) {
  EXPECT_THROW(parallelFor(100, 2,
                           [](std::size_t i) {
                             if (i == 7) throw std::runtime_error("seven");
                           }),
               std::runtime_error);
}

TEST(Page, EscapesTextAndAlignsWords) {
  PageSection section;
  section.heading = "a < b & \"c\"";
  section.tables.push_back({"t", "caption", {"word", "number"}, {{std::string("<x>"), 1.5}}});
  const std::string page = htmlPage("title", {section}, ".");
  EXPECT_NE(page.find("a &lt; b &amp; &quot;c&quot;"), std::string::npos);
  EXPECT_NE(page.find("<td class=\"t\">&lt;x&gt;</td><td>1.5</td>"), std::string::npos);
}

}  // namespace
}  // namespace filiform::tools
