#include "index/input/internal/chosen_objects.h"

#include "index/errors.h"
#include "index/formats/neuroglancer/internal/spatial_index.h"
#include "index/remote/internal/http_errors.h"
#include "index/text.h"
#include "index/workers.h"

#include <algorithm>
#include <iterator>
#include <map>
#include <mutex>
#include <optional>
#include <utility>
#include <vector>

namespace filiform::internal {
namespace {

using Ids = std::vector<std::uint64_t>;

Ids objectsWhere(const AttributeConditions& conditions, const SegmentProperties& properties) {
  const auto attributesOf = [&](std::uint64_t id) {
    Cell cell;
    properties.apply(id, cell);
    return std::move(cell.attributes);
  };
  std::map<std::string, bool> are_text;  // by name
  for (const std::uint64_t id : properties.ids())
    for (const CellAttribute& attribute : attributesOf(id))
      are_text[attribute.name] |= typeOf(attribute.value) == AttributeType::text;
  for (const AttributeConditions::Condition& condition : conditions.all()) {
    const auto at = are_text.find(condition.name);
    std::string names;
    for (const auto& [name, is_text] : are_text) names += (names.empty() ? "" : ", ") + escaped(name, 80);
    if (at == are_text.end())
      condition.refuseName("the objects have no property " + escaped(condition.name, 80) + "; the properties are " +
                           escaped(names, 600));
    if (at->second && condition.ofOrder()) condition.refuseText();
  }
  Ids chosen;
  for (const std::uint64_t id : properties.ids()) {
    const std::vector<CellAttribute> attributes = attributesOf(id);
    const bool meets = std::all_of(conditions.all().begin(), conditions.all().end(), [&](const auto& condition) {
      const auto at = std::find_if(attributes.begin(), attributes.end(),
                                   [&](const CellAttribute& a) { return a.name == condition.name; });
      return condition.meets(at == attributes.end() ? AttributeValue() : at->value);
    });
    if (meets) chosen.push_back(id);
  }
  return chosen;
}

Ids objectsIn(const Box_nm& box, const SkeletonFiles& files, const SpatialIndex& index, std::size_t connections) {
  const std::vector<std::string> names = index.filesIn(box);
  std::mutex mutex;
  Ids ids;
  runItems(names.size(), requestsAtOnce(connections), [&](std::size_t i) {
    auto text = files.findText(names[i], SpatialIndex::kMaxBytes);
    if (!text) text = files.findText(names[i] + ".gz", SpatialIndex::kMaxBytes);  // as CloudVolume copies it
    if (!text)
      throw IoError(inShort(files.pathOf(names[i])),
                    "is missing, so the spatial index has a hole in this box; name the objects with --ids");
    Ids here;
    SpatialIndex::objectsIn(box, *text, files.pathOf(names[i]), here);
    const std::scoped_lock lock(mutex);
    ids.insert(ids.end(), here.begin(), here.end());
  });
  std::sort(ids.begin(), ids.end());
  ids.erase(std::unique(ids.begin(), ids.end()), ids.end());
  return ids;
}

}  // namespace

std::shared_ptr<const SegmentProperties> readProperties(const SkeletonFiles& files, const SkeletonInfo& info,
                                                        const SkeletonVolume* through) {
  const auto read = [](const SkeletonFiles& from, const std::string& folder) {
    std::shared_ptr<const SegmentProperties> properties;
    if (folder.empty()) return properties;
    const std::string file = folder + "/info";
    if (const auto text = from.findText(file, SegmentProperties::kMaxBytes))
      properties = std::make_shared<const SegmentProperties>(*text, from.pathOf(file));
    return properties;
  };
  auto properties = read(files, info.segment_properties);
  return properties || through == nullptr ? properties : read(*through->files, through->segment_properties);
}

ObjectIds chosenObjects(const SkeletonFiles& files, const std::string& info, const SegmentProperties* properties,
                        const std::function<SkeletonVolume()>& volume, const ListingOptions& options) {
  std::optional<Ids> chosen;
  const auto keep = [&](Ids ids) {
    if (chosen) {
      Ids both;
      std::set_intersection(chosen->begin(), chosen->end(), ids.begin(), ids.end(), std::back_inserter(both));
      ids = std::move(both);
    }
    chosen = std::move(ids);
  };
  if (options.where.empty() && !options.box_um) return options.ids;
  if (options.ids) keep(*options.ids);
  if (!options.where.empty()) {
    if (properties == nullptr)
      throw InputError(inShort(files.pathOf("info")) +
                       ": names no segment_properties, so --where cannot choose; name the objects with --ids");
    keep(objectsWhere(options.where, *properties));
  }
  if (options.box_um) {
    Box_nm box{};
    for (int corner = 0; corner < 2; ++corner)
      for (int axis = 0; axis < 3; ++axis) box[corner][axis] = (*options.box_um)[corner][axis] * 1000;
    const SkeletonVolume whole = volume();
    const SpatialIndex index(info, files.pathOf("info"), whole.info, whole.files->pathOf("info"));
    keep(objectsIn(box, files, index, options.remote.connections));
  }
  if (chosen->empty())
    throw InputError(inShort(files.pathOf("info")) + ": --ids, --where and --box together choose none of its objects");
  return std::make_shared<const Ids>(*std::move(chosen));
}

}  // namespace filiform::internal
