// The answer of the route density: the length of neurites in each box of a grid.
#include "index/count_text.h"
#include "index/measure/neurite_density.h"
#include "tools/serve/routes/service.h"
#include "tools/serve/sets/limits.h"
#include "tools/words/measure_table.h"

#include <utility>

namespace filiform::tools {

Answer densityAnswer(const Call& call) {
  using Json = nlohmann::ordered_json;
  const ServedSet& served = *call.served;
  const auto step_um = call.request.number("step");
  if (!step_um) throw Refusal(400, "give step=UM, the edge of the boxes");
  DensityOptions options{
      .step_um = *step_um, .most_boxes = limits::kMeasuredValues, .check = [] { TimedStore::check(); }};
  if (const auto type = call.request.parameter("type")) options.types = parseNeuriteTypes(*type, "type");
  if (const auto conditions = call.request.parameter("where")) options.cells = cellsMeeting(served, *conditions);
  std::uint64_t segments = served.store().segmentCount();
  if (options.cells) {
    segments = 0;
    for (const std::uint32_t cell : *options.cells) segments += served.store().cell(cell).segments;
  }
  if (segments > limits::kBoxSegments)
    throw Refusal(413, "the cells have more than " + formatCount(limits::kBoxSegments) +
                           " segments; give where= for fewer, or use filiform measure --density on the set's files");
  const NeuriteDensity density = densityOf(served.store(), options);
  Json boxes = Json::array();
  for (std::size_t box = 0; box < density.lengths_um.size(); ++box) {
    if (!(density.lengths_um[box] > 0)) continue;
    const Vector3d corner_um = density.cornerOf(box);
    boxes.push_back({{"x", corner_um.x()},
                     {"y", corner_um.y()},
                     {"z", corner_um.z()},
                     {"length", density.lengths_um[box]},
                     {"density", density.lengths_um[box] / density.box_um3()}});
  }
  const Vector3d origin_um = density.corner_um(0, 0, 0);
  return jsonAnswer({{"step", density.step_um},
                     {"origin", {origin_um.x(), origin_um.y(), origin_um.z()}},
                     {"shape", density.boxes},
                     {"boxes", std::move(boxes)}});
}

}  // namespace filiform::tools
