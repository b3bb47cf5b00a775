// One tick of a run, as a row of the CSV that `filiform navigate --csv` writes. Thread rule: functions without state.
#pragma once

#include "index/tile/tile.h"

#include <cstdint>
#include <iosfwd>
#include <string_view>

namespace filiform {

struct TickRow {
  std::uint64_t tick = 0;                     // from 0
  double time_s = 0;                          // begin of this tick, from the first tick
  Vector3d h_W = Vector3d::Zero();            // probe, um
  Vector3d p_W = Vector3d::Zero();            // proxy, um
  SegmentId segment{UINT32_MAX, UINT32_MAX};  // the proxy's segment
  Vector3d force_N = Vector3d::Zero();        // computed by this tick, frame D
  std::uint32_t visited = 0;                  // segments tested
  bool frontier = false;                      // the proxy rests at an absent tile
};

// Writes the line with the names of the columns.
void writeCsvHeader(std::ostream& out);
// Writes numbers as the shortest decimals that read back to the same double. `cell_name` is written between quotation
// marks; each quotation mark in it is doubled. An empty name gives an empty field.
void writeCsvRow(std::ostream& out, const TickRow& row, std::string_view cell_name = {});

}  // namespace filiform
