// filiform-hdf5: reads HDF5 files for filiform, in a process of its own (index/hdf5/internal/hdf5_protocol.h).
#include "index/hdf5/internal/hdf5_protocol.h"
#include "index/hdf5/program/file_reader.h"
#include "index/hdf5/program/file_writer.h"
#include "index/hdf5/program/record_pipe.h"

#include <algorithm>
#include <csignal>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <new>
#include <string>
#include <sys/resource.h>
#include <vector>

namespace {

using namespace filiform::hdf5;

// The address space of a process under these sanitizers exceeds any limit.
#if defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__)
constexpr bool kLimitsMemory = false;
#else
constexpr bool kLimitsMemory = true;
#endif

void limit(int resource, rlim_t value) {
  rlimit now{};
  if (getrlimit(static_cast<__rlimit_resource_t>(resource), &now) != 0) return;
  now.rlim_cur = now.rlim_max == RLIM_INFINITY ? value : std::min(value, now.rlim_max);
  setrlimit(static_cast<__rlimit_resource_t>(resource), &now);
}

void answer(const std::vector<std::string>& request, FileWriter& writer, RecordPipe& pipe) {
  const std::string op = request.empty() ? "" : request[0];
  if (op == "morphologies" && request.size() == 2) {
    FileReader(request[1]).morphologies(pipe);
  } else if (op == "morphology" && request.size() == 3) {
    FileReader(request[1]).morphology(request[2], pipe);
  } else if (op == "populations" && request.size() == 2) {
    FileReader(request[1]).populations(pipe);
  } else if (op == "population" && request.size() == 3) {
    FileReader(request[1]).population(request[2], pipe);
  } else if (op == "create" && request.size() == 2) {
    writer.create(request[1]);
  } else if (op == "write" && request.size() == 5) {
    writer.write(request, pipe);
  } else if (op == "finish" && request.size() == 1) {
    writer.finish();
  } else {
    throw Failure("a request that filiform-hdf5 does not know");
  }
}

}  // namespace

int main(int argc, char** argv) {
  std::uint64_t memory_mib = 2048;
  for (int i = 1; i < argc; ++i) {
    if (std::strcmp(argv[i], "--memory-mib") == 0 && i + 1 < argc) {
      memory_mib = std::strtoull(argv[++i], nullptr, 10);
    } else {
      std::puts(
          "filiform-hdf5 reads HDF5 files for filiform, which starts it when it needs it.\n"
          "It reads requests from standard input and writes records to standard output:\n"
          "index/hdf5/internal/hdf5_protocol.h specifies both.\n\nUsage: filiform-hdf5 [--memory-mib N]");
      return std::strcmp(argv[i], "--help") == 0 ? 0 : 2;
    }
  }
  std::signal(SIGINT, SIG_IGN);  // a terminal sends it to all; filiform ends this process
  if (kLimitsMemory) limit(RLIMIT_AS, memory_mib << 20);
  limit(RLIMIT_CORE, 0);
  FileReader::prepare();
  RecordPipe pipe;
  FileWriter writer;
  for (std::vector<std::string> request; pipe.readRequest(request);) {
    try {
      answer(request, writer, pipe);
      pipe.end();
    } catch (const Failure& failure) {
      pipe.fail(failure.what());
    } catch (const std::bad_alloc&) {
      pipe.fail("reading it takes more memory than " + std::to_string(memory_mib) + " MiB");
    }
  }
  return 0;
}
