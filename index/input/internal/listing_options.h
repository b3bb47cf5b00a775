// Which inputs are listed. Thread rule: values.
#pragma once

#include "index/cell/attribute_conditions.h"
#include "index/containers/versions.h"
#include "index/geometry/grid.h"
#include "index/remote/remote_options.h"

#include <array>
#include <cstdint>
#include <memory>
#include <optional>
#include <vector>

namespace filiform::internal {

using ObjectIds = std::shared_ptr<const std::vector<std::uint64_t>>;  // ascending; null: all

struct ListingOptions {
  MorphologyVersion versions = MorphologyVersion::cng;
  ObjectIds ids = {};                                  // of skeletons
  AttributeConditions where{{}};                       // on their properties
  std::optional<std::array<Vector3d, 2>> box_um = {};  // where some of their nodes are
  RemoteOptions remote = {};
};

}  // namespace filiform::internal
