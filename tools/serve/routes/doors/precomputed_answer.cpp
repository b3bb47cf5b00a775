// The answers of the door for Neuroglancer: skeletons on demand, unsharded.
#include "index/export/skeleton_format.h"
#include "index/export/skeleton_properties.h"
#include "index/query/cell_graph.h"
#include "index/text.h"
#include "tools/serve/routes/service.h"
#include "tools/serve/sets/limits.h"

#include <charconv>
#include <sstream>

namespace filiform::tools {

namespace {

SkeletonFormat formatOf(const ServedSet& served) {
  return SkeletonFormat(served.set().grid(), served.set().bounds(), SkeletonFormat::WideBounds::round);
}

}  // namespace

Answer precomputedInfoAnswer(const Call& call) { return {.type = kJsonType, .body = formatOf(*call.served).info()}; }

Answer precomputedPropertiesAnswer(const Call& call) {
  const CellNumbers& numbers = call.served->cellNumbers();
  const TileStore& store = call.served->store();
  if (store.cell_count() > limits::kDoorCells)
    throw Refusal(413, "the set has more than " + std::to_string(limits::kDoorCells) +
                           " cells; Neuroglancer shows their skeletons without names");
  std::vector<SkeletonCell> cells;
  for (std::uint32_t cell = 0; cell < store.cell_count(); ++cell) {
    if (cell % 256 == 0) TimedStore::check();
    if (!store.cell(cell).removed) cells.push_back({numbers.of(cell), cell});
  }
  return {.type = kJsonType, .body = skeletonProperties(store, cells, &call.served->attributes())};
}

Answer precomputedSkeletonAnswer(const Call& call) {
  const std::string& name = call.captured.at(1);
  std::uint64_t number = 0;
  const auto [end, error] = std::from_chars(name.data(), name.data() + name.size(), number);
  const bool whole = error == std::errc{} && end == name.data() + name.size() && std::to_string(number) == name;
  const auto cell = whole ? call.served->cellNumbers().find(number) : std::nullopt;
  if (!cell)
    throw Refusal(404,
                  "the set has no skeleton '" + escaped(name, 40) + "'; segment_properties/info lists the numbers");
  refuseLargeCell(call.served->store().cell(*cell));
  std::ostringstream bytes;
  formatOf(*call.served).write(bytes, readCell(call.served->kept(), *cell, true));
  return {.type = kBytesType, .body = std::move(bytes).str()};
}

}  // namespace filiform::tools
