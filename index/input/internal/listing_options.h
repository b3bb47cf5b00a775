// Which inputs are listed. Thread rule: values.
#pragma once

#include "index/cell/attribute_conditions.h"
#include "index/containers/versions.h"
#include "index/geometry/grid.h"
#include "index/remote/remote_options.h"

#include <algorithm>
#include <array>
#include <cstddef>
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

// Small files that are asked of a server at a time.
inline std::size_t requestsAtOnce(std::size_t connections) { return std::min<std::size_t>(16, connections); }

}  // namespace filiform::internal
