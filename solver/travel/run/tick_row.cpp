#include "solver/travel/run/tick_row.h"

#include <charconv>
#include <ostream>

namespace filiform {

void writeCsvHeader(std::ostream& out) {
  out << "tick,time_s,hx_um,hy_um,hz_um,px_um,py_um,pz_um,cell,segment,fx_N,fy_N,fz_N,visited,frontier,cell_name\n";
}

void writeCsvRow(std::ostream& out, const TickRow& row, std::string_view cell_name) {
  char line[512];
  char* at = line;
  char* const end = line + sizeof line;
  const auto put = [&](auto value) {
    at = std::to_chars(at, end - 1, value).ptr;
    *at++ = ',';
  };
  put(row.tick);
  put(row.time_s);
  for (int axis = 0; axis < 3; ++axis) put(row.h_W[axis]);
  for (int axis = 0; axis < 3; ++axis) put(row.p_W[axis]);
  put(row.segment.cell);
  put(row.segment.segment);
  for (int axis = 0; axis < 3; ++axis) put(row.force_N[axis]);
  put(row.visited);
  put(row.frontier ? 1 : 0);
  out.write(line, at - line);
  if (!cell_name.empty()) {
    out << '"';
    for (const char c : cell_name) {
      if (c == '"') out << '"';
      out << c;
    }
    out << '"';
  }
  out << '\n';
}

}  // namespace filiform
