// filiform.h: sets and their cells.
#include "index/cell/glob.h"
#include "index/streaming/residency.h"
#include "index/text.h"
#include "tools/c/open_set.h"
#include "tools/words/token.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <string>

namespace filiform::c {

namespace {

void fillBox(const TileSet& set, const GridBox& box, double lo_um[3], double hi_um[3]) {
  const double nowhere = std::numeric_limits<double>::quiet_NaN();
  Vector3d lo = Vector3d::Constant(nowhere), hi = lo;
  if (!box.empty()) {
    lo = set.grid().toWorld(box.lo);
    hi = set.grid().toWorld(box.hi);
  }
  std::copy_n(lo.data(), 3, lo_um);
  std::copy_n(hi.data(), 3, hi_um);
}

RemoteOptions remoteOf(const filiform_open_options& options) {
  RemoteOptions remote;
  if (options.token != nullptr && *options.token != '\0') remote.token = tools::tokenIn(options.token, "token");
  if (options.cache_folder != nullptr) remote.cache_folder = options.cache_folder;
  if (options.cache_bytes != 0) remote.cache_bytes = options.cache_bytes;
  return remote;
}

}  // namespace

void OpenSet::requireCell(std::uint32_t cell) const {
  if (cell >= set->cell_count())
    throw UsageError("cell " + std::to_string(cell) + ": the set has cells 0 to " +
                     std::to_string(std::int64_t{set->cell_count()} - 1));
}

}  // namespace filiform::c

using namespace filiform;
using namespace filiform::c;

extern "C" {

int filiform_open(const char* name, const filiform_open_options* options, filiform_set** set) {
  return call([&] {
    *required(set, "set") = nullptr;
    required(name, "name");
    const filiform_open_options wanted = optionsOr(options, "options");
    NearestOptions searching;
    if (wanted.memory_bytes != 0) searching.budget_bytes = wanted.memory_bytes;
    auto opened = std::make_shared<SetHandle>(
        std::make_shared<OpenSet>(std::make_shared<SetFiles>(TileSet::open(name, remoteOf(wanted))), searching));
    *set = static_cast<filiform_set*>(HandleTable::ofProcess().add(HandleKind::set, std::move(opened)));
  });
}

int filiform_close(filiform_set* set) {
  return call([&] { HandleTable::ofProcess().close(set, HandleKind::set, "set"); });
}

int filiform_get_info(filiform_set* set, filiform_info* info) {
  return call([&] {
    const HeldSet held(set, "set");
    sized(info, "info");
    const TileSet& s = *(*held)->set;
    const SetCounts& counts = s.counts();
    filiform_info told{};
    told.struct_size = info->struct_size;
    told.capacity = s.capacity();
    told.cells = counts.cells;
    told.samples = counts.samples;
    told.segments = counts.segments;
    told.isolated = counts.isolated;
    told.roots = counts.roots;
    told.removed = counts.removed;
    told.tiles = counts.tiles;
    told.stored_segments = counts.stored_segments;
    told.bytes = s.bytes();
    told.decoded_bytes = counts.decoded_bytes;
    told.smallest_budget_bytes = Residency::floorBytes(s);
    told.refused = s.refused();
    told.cell_ids = s.cell_count();
    told.quantum_um = s.grid().quantum_um();
    fillBox(s, s.bounds(), told.lo_um, told.hi_um);
    *info = told;
  });
}

int filiform_get_cell_info(filiform_set* set, uint32_t cell, filiform_cell_info* info) {
  return call([&] {
    const HeldSet held(set, "set");
    sized(info, "info");
    (*held)->requireCell(cell);
    const TileSet& s = *(*held)->set;
    const CellRecord& record = s.cell(cell);
    filiform_cell_info told{};
    told.struct_size = info->struct_size;
    told.removed = record.removed;
    told.has_loops = !record.removed && hasLoops(record);
    told.name = record.name.c_str();
    told.source = record.source.c_str();
    told.samples = record.samples;
    told.segments = record.segments;
    told.isolated = record.isolated;
    told.roots = record.roots;
    fillBox(s, record.bounds, told.lo_um, told.hi_um);
    *info = told;
  });
}

int filiform_find_cell(filiform_set* set, const char* name, uint32_t* cell) {
  return call([&] {
    const HeldSet held(set, "set");
    *required(cell, "cell") = FILIFORM_NONE;
    const std::optional<std::uint32_t> found = (*held)->set->findCell(required(name, "name"));
    if (!found) throw UsageError("no cell has the name '" + escaped(name, 80) + "'");
    *cell = *found;
  });
}

int filiform_cells(filiform_set* set, const char* pattern, uint32_t** cells, size_t* count) {
  return call([&] {
    *required(cells, "cells") = nullptr;
    *required(count, "count") = 0;
    const HeldSet held(set, "set");
    const TileSet& s = *(*held)->set;
    std::vector<std::uint32_t> ids;
    for (std::uint32_t id = 0; id < s.cell_count(); ++id) {
      const CellRecord& record = s.cell(id);
      if (!record.removed && (pattern == nullptr || matchesName(pattern, record.name))) ids.push_back(id);
    }
    *cells = arrayOf(ids);
    *count = ids.size();
  });
}

}  // extern "C"
