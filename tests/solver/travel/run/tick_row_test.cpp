#include "solver/travel/run/tick_row.h"

#include <sstream>

#include <gtest/gtest.h>

namespace filiform {
namespace {

TEST(TickRow, TheCsvHasItsColumns) {
  TickRow row;
  row.tick = 3;
  row.time_s = 0.003;
  row.h_W = {1, 2, 3};
  row.p_W = {4, 5, 0.1};
  row.segment = {7, 9};
  row.force_N = {-0.5, 0, 1e-7};
  row.visited = 2;
  row.frontier = true;
  std::ostringstream out;
  writeCsvHeader(out);
  writeCsvRow(out, row);
  writeCsvRow(out, row, "an, \"odd\" name");
  EXPECT_EQ(out.str(),
            "tick,time_s,hx_um,hy_um,hz_um,px_um,py_um,pz_um,cell,segment,fx_N,fy_N,fz_N,visited,frontier,cell_name\n"
            "3,0.003,1,2,3,4,5,0.1,7,9,-0.5,0,1e-07,2,1,\n"
            "3,0.003,1,2,3,4,5,0.1,7,9,-0.5,0,1e-07,2,1,\"an, \"\"odd\"\" name\"\n");
}

}  // namespace
}  // namespace filiform
