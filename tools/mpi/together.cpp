#include "tools/mpi/together.h"

#include "index/errors.h"
#include "tools/commands/commands.h"
#include "tools/mpi/mpi_ranks.h"
#include "tools/program/interruption.h"

#include <exception>
#include <fcntl.h>
#include <memory>
#include <new>
#include <string>
#include <unistd.h>

#include <CLI/CLI.hpp>

namespace filiform::tools {
namespace {

MpiRanks* job = nullptr;  // of this process, while runTogether() runs

// Throws what the program reports, with its exit code.
[[noreturn]] void report(const MpiRanks::Failure& failure) {
  const std::string text =
      failure.everywhere ? failure.why : "rank " + std::to_string(failure.rank) + ": " + failure.why;
  if (failure.exit_code == 1) throw InputError(text);
  if (failure.exit_code == 2) throw UsageError(text);
  if (failure.exit_code > 128) throw Interrupted(text);
  if (failure.everywhere) throw std::runtime_error(text);
  throw IoError("rank " + std::to_string(failure.rank), failure.why);
}

int runOnAll(const std::function<int()>& run) {
  MpiRanks& ranks = *job;
  if (ranks.count() == 1) return run();
  int code = 3;
  std::string why;
  try {
    return run();
  } catch (const RankFailed&) {
  } catch (const Interrupted& error) {
    code = interruptedExitCode();
    why = error.what();
  } catch (const UsageError& error) {
    code = 2;
    why = error.what();
  } catch (const IoError& error) {
    why = error.what();
  } catch (const Error& error) {
    code = 1;
    why = error.what();
  } catch (const std::bad_alloc&) {
    why = "out of memory";
  } catch (const std::exception& error) {
    why = error.what();
  }
  report(ranks.fail(code, why));
}

void addTogether(CLI::App& app, Chosen& chosen) {
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
      "filiform-mpi: ingest by several processes together.",
      "Start it with mpirun or srun:\n  mpirun -n 4 filiform-mpi ingest archive.zip folder/ -o column.fil\n"
      "The set is the one that filiform ingest makes.",
      {addTogether},
      nullptr,
      "filiform-mpi"};
  const int code = runProgram(kTogether, argc, argv);
  ranks.end(code);
  job = nullptr;
  return code;
}

}  // namespace filiform::tools
