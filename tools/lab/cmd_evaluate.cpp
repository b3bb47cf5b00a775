// filiform evaluate: compares all methods on the paper's scenes and on routes of many cells, with a simulated hand.
#include "index/errors.h"
#include "index/input/input.h"
#include "index/text.h"
#include "tools/lab/evaluate/evaluation.h"
#include "tools/lab/lab_commands.h"
#include "tools/program/interruption.h"
#include "tools/program/output_check.h"
#include "tools/program/progress.h"
#include "tools/program/progress_option.h"
#include "tools/synthetic/synthetic.h"

#include <algorithm>
#include <cstdlib>
#include <filesystem>
#include <iostream>
#include <memory>
#include <string>
#include <system_error>
#include <thread>

#include <CLI/CLI.hpp>

namespace filiform::tools {

namespace {

constexpr std::uint32_t kSyntheticCells = 12, kSyntheticTraces = 6;

SyntheticOptions synthetic(const std::string& kind, std::uint32_t cells, std::uint64_t seed) {
  SyntheticOptions options;
  options.kind = kind;
  options.cells = cells;
  options.seed = seed;
  return options;
}

class ColumnThenTraces final : public CellStream {
 public:
  explicit ColumnThenTraces(std::uint64_t seed)
      : column_(synthetic("column", kSyntheticCells, seed)), traces_(synthetic("traces", kSyntheticTraces, seed)) {}
  bool next(Cell& cell) override { return column_.next(cell) || traces_.next(cell); }

 private:
  SyntheticCells column_, traces_;
};

// A folder for results. A refused run leaves the folder unchanged.
class ResultFolder {
 public:
  explicit ResultFolder(const std::string& path) : path_(path) {
    std::error_code error;
    made_ = std::filesystem::create_directories(path, error);
    if (error) throw IoError(escaped(path), "cannot make the folder", error.value());
  }
  ~ResultFolder() {
    std::error_code not_empty;
    if (made_) std::filesystem::remove(path_, not_empty);
  }
  ResultFolder(const ResultFolder&) = delete;
  ResultFolder& operator=(const ResultFolder&) = delete;

 private:
  std::string path_;
  bool made_ = false;
};

int runEvaluate(EvaluationOptions options) {
  const char* const corpus = std::getenv("FILIFORM_CORPUS");
  if (options.corpus.empty() && !options.quick && corpus != nullptr) options.corpus = corpus;
  checkOutputFolder({{"--corpus", options.corpus}}, {"--output", options.out});
  const ResultFolder folder(options.out);
  if (options.threads == 0) options.threads = std::max(1u, std::thread::hardware_concurrency());

  std::unique_ptr<Progress> progress;
  std::string shown_stage;
  options.progress = [&](const std::string& stage, std::uint64_t done, std::uint64_t total) {
    throwIfInterrupted();
    if (stage != shown_stage) {
      progress.reset();
      ProgressOptions line;
      line.title = "evaluate: " + stage;
      line.noun = "trials";
      line.total = total;
      progress = std::make_unique<Progress>(line);
      shown_stage = stage;
    }
    progress->update(done);
  };
  std::unique_ptr<CellStream> cells;
  if (options.corpus.empty()) {
    if (options.quick)
      cells = std::make_unique<SyntheticCells>(synthetic("column", 1, options.seed));
    else
      cells = std::make_unique<ColumnThenTraces>(options.seed);
  } else {
    cells = std::make_unique<Input>(std::vector<std::string>{options.corpus});
    options.corpus = std::filesystem::path(options.corpus).lexically_normal().filename().string();
  }
  const std::string text = evaluate(*cells, options);
  if (progress) progress->finish();
  std::cout << text;
  return 0;
}

}  // namespace

void addEvaluate(CLI::App& app, Chosen& chosen) {
  auto options = std::make_shared<EvaluationOptions>();
  options->threads = 0;
  CLI::App* evaluate = app.add_subcommand("evaluate", "Compare all methods on the paper's scenes and on many routes");
  evaluate->footer(
      "Examples:\n  filiform evaluate --out eval\n  filiform evaluate --out eval --corpus morphologies/ --routes 2000");
  evaluate->add_option("-o,--output,--out", options->out, "write the page, tables, plots and CSV to this folder")
      ->capture_default_str();
  evaluate->add_option(
      "--corpus", options->corpus,
      "SWC files, folders or archives; default: the variable FILIFORM_CORPUS, otherwise synthetic cells; with --quick "
      "synthetic cells");
  evaluate->add_option("--routes", options->routes,
                       "number of routes over all cells; 0: 2000 on a corpus, 24 on synthetic cells");
  evaluate->add_option("--seed", options->seed, "random seed of routes, tremor, synthetic cells and pulls")
      ->capture_default_str();
  evaluate->add_option("--threads", options->threads, "use N threads; 0: one a core")->capture_default_str();
  evaluate->add_option("--methods", options->methods, "basic,shading,force,force-listing,climb,nearest; default: all")
      ->delimiter(',');
  evaluate->add_option("--zooms", options->zooms_um, "zooms of the main tables, um across 12 cm; default: 100,300,1000")
      ->delimiter(',');
  evaluate
      ->add_option(
          "--scenes", options->scenes,
          "run only these scenes, with 20 tremors: " + kindList(sceneKinds()) + ", " + kindList(hardSceneKinds()))
      ->delimiter(',');
  evaluate->add_option("--leap", options->leap, "let climb use this part of its budget, as filiform navigate --leap")
      ->capture_default_str()
      ->check(CLI::Range(0.0, 1.0));
  evaluate->add_flag("--quick", options->quick, "run a few of everything, to see that it works");
  addProgressOption(*evaluate);
  evaluate->callback([options, &chosen] { chosen = [options] { return runEvaluate(*options); }; });
}

}  // namespace filiform::tools
