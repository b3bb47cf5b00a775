// How Input reads. Thread rule: values.
#pragma once

#include "index/containers/versions.h"
#include "index/formats/swc.h"
#include "index/geometry/grid.h"
#include "index/remote/remote_options.h"

#include <array>
#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

namespace filiform {

struct InputOptions {
  SwcOptions swc;
  std::uint64_t memory = UINT64_MAX;                    // bytes
  double cell_share = 0.625;                            // fraction of `memory` that one cell may take while it is read
  MorphologyVersion versions = MorphologyVersion::cng;  // of neurons that a folder or archive holds twice
  // A file is one cell, also if it holds several (cell_parts.h).
  bool one_cell_a_file = false;
  // Objects of precomputed skeletons to read, ascending; null: all.
  std::shared_ptr<const std::vector<std::uint64_t>> ids = {};
  // Of them, those whose segment properties meet these conditions (index/cell/attribute_conditions.h).
  std::vector<std::string> where = {};
  // Of them, those that the spatial index places in this box, um: lowest and highest corner.
  std::optional<std::array<Vector3d, 2>> box_um = {};
  RemoteOptions remote = {};  // for addresses
  // Threads that read, the calling one included; fewer if half of the share of a cell does not suffice for them, at
  // 16 MiB each.
  unsigned threads = 1;
  // Called after each block or input read, and every 0.1 s of waiting: `done` of `total` bytes of the files on disk. An
  // exception that it throws ends the run.
  std::function<void(std::uint64_t done, std::uint64_t total)> progress;
};

// A file to read under a name of the caller's choice.
struct InputFile {
  std::string path;
  std::string shown;                                  // the source, or its beginning for the entries of a container
  std::optional<std::vector<std::string>> only = {};  // ascending: morphologies of an H5 container; others are left out
};

}  // namespace filiform
