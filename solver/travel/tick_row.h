// One tick of a run, as a row of the CSV that `filiform navigate --csv` writes. Thread rule: functions without state.
#pragma once

#include "index/tile/tile.h"

#include <cstdint>
#include <iosfwd>
#include <string_view>

namespace filiform {

struct TickRow {
  std::uint64_t tick = 0;                     // from 0
  double time_s = 0;                          // from the first tick, when this tick began
  Vector3d h_W = Vector3d::Zero();            // probe, um
  Vector3d p_W = Vector3d::Zero();            // proxy, um
  SegmentId segment{UINT32_MAX, UINT32_MAX};  // on which the proxy is
  Vector3d force_N = Vector3d::Zero();        // computed by this tick, frame D
  std::uint32_t visited = 0;                  // segments tested
  bool frontier = false;                      // the proxy rests at an absent tile
};

// The line with the names of the columns.
void writeCsvHeader(std::ostream& out);
// Numbers are the shortest decimals that read back to the same double. `cell_name` is written between quotation marks,
// and each quotation mark in it is doubled. An empty name is an empty field.
void writeCsvRow(std::ostream& out, const TickRow& row, std::string_view cell_name = {});

}  // namespace filiform
