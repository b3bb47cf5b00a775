#include "tools/mpi/together.h"

#include "index/errors.h"
#include "tools/commands/commands.h"
#include "tools/mpi/mpi_ranks.h"
#include "tools/program/interruption.h"

#include <csignal>
#include <exception>
#include <fcntl.h>
#include <memory>
#include <string>
#include <unistd.h>

#include <CLI/CLI.hpp>

namespace filiform::tools {
namespace {

constexpr int kClosedPipe = 128 + SIGPIPE;

MpiRanks* job = nullptr;  // of this process, while runTogether() runs

// Throws what the program reports, with its exit code.
[[noreturn]] void report(const MpiRanks::Failure& failure) {
  if (failure.exit_code == kClosedPipe) throw ClosedPipe(failure.why);
  // A refusal by rank 0 alone is about what only rank 0 reads, as the file of --points.
  const bool unnamed = failure.everywhere || (failure.exit_code == 2 && failure.rank == 0);
  const std::string text = unnamed ? failure.why : "rank " + std::to_string(failure.rank) + ": " + failure.why;
  if (failure.exit_code == 1) throw InputError(text);
  if (failure.exit_code == 2) throw UsageError(text);
  if (failure.exit_code > 128) throw Interrupted(text);
  if (!failure.everywhere) throw IoError("rank " + std::to_string(failure.rank), failure.why);
  const std::size_t colon = text.find(": ");  // after the file
  if (colon == std::string::npos) throw IoError("every rank", text);
  throw IoError(text.substr(0, colon), text.substr(colon + 2));
}

int runOnAll(const std::function<int()>& run) {
  try {
    return run();
  } catch (const std::exception& error) {
    job->fail(error);
    if (!job->failure()) throw;  // one rank
  }
  report(*job->failure());
}

void addIngestOnRanks(CLI::App& app, Chosen& chosen) {
  const auto exchange = std::make_shared<std::string>("network");
  addIngestTogether(app, chosen, *job, [exchange](const std::function<int()>& run) {
    job->setExchange(*exchange == "files" ? MpiRanks::Exchange::files : MpiRanks::Exchange::network);
    return runOnAll(run);
  });
  app.get_subcommand("ingest")
      ->add_option("--exchange", *exchange,
                   "pass segments and tiles between ranks over the network (MPI), or through files in the set's folder")
      ->check(CLI::IsMember({"network", "files"}))
      ->type_name("WAY")
      ->capture_default_str();
}

void addCheckOnRanks(CLI::App& app, Chosen& chosen) { addCheckTogether(app, chosen, *job, runOnAll); }

void addNearestOnRanks(CLI::App& app, Chosen& chosen) { addNearestTogether(app, chosen, *job, runOnAll); }

void silence() {
  const int nowhere = ::open("/dev/null", O_WRONLY | O_CLOEXEC);
  if (nowhere < 0) return;
  ::dup2(nowhere, STDOUT_FILENO);
  ::dup2(nowhere, STDERR_FILENO);
  ::close(nowhere);
}

}  // namespace

int runTogether(int argc, char** argv) {
  MpiRanks ranks;
  job = &ranks;
  if (ranks.rank() != 0) silence();
  static const Program kTogether{
      "filiform-mpi: commands of filiform by several processes together.",
      "Start it with mpirun or srun:\n  mpirun -n 4 filiform-mpi ingest archive.zip folder/ -o column.fil\n"
      "  mpirun -n 4 filiform-mpi nearest column.fil --points soma.txt\n"
      "filiform-mpi writes the same bytes as filiform.",
      {addIngestOnRanks, addCheckOnRanks, addNearestOnRanks},
      nullptr,
      "filiform-mpi"};
  const int code = runProgram(kTogether, argc, argv);
  ranks.end(code);
  job = nullptr;
  return code;
}

}  // namespace filiform::tools
