// Makes a tile set of one input, with levels of detail, so that the bytes of processors can be compared.
//
//   made_set INPUT SET
#include "index/ingest/ingest.h"
#include "index/input/input.h"

#include <cstdio>
#include <exception>

int main(int argc, char** argv) {
  using namespace filiform;
  if (argc != 3) {
    std::fprintf(stderr, "made_set: needs INPUT SET\n");
    return 2;
  }
  try {
    Input input({argv[1]});
    IngestOptions options;
    options.levels = true;
    ingest(input, argv[2], options);
  } catch (const std::exception& error) {
    std::fprintf(stderr, "made_set: %s\n", error.what());
    return 1;
  }
  return 0;
}
