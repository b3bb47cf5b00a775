// Which objects of precomputed skeletons are read: those that ids, segment properties and a spatial index choose.
// Thread rule: pure functions.
#pragma once

#include "index/containers/internal/skeleton_source.h"
#include "index/formats/neuroglancer/internal/segment_properties.h"
#include "index/input/internal/listing_options.h"

#include <functional>
#include <memory>
#include <string>

namespace filiform::internal {

// A folder whose info names the skeletons, and describes the volume.
struct SkeletonVolume {
  std::shared_ptr<const SkeletonFiles> files;
  std::string info;                // its text
  std::string segment_properties;  // a folder below; empty: none
};

// The segment properties of skeletons, or without any those of the volume through which they were found; null if there
// are none. Throws InputError and IoError.
std::shared_ptr<const SegmentProperties> readProperties(const SkeletonFiles& files, const SkeletonInfo& info,
                                                        const SkeletonVolume* through);

// The ids of the options, of them those whose properties meet ListingOptions::where, and of them those that the spatial
// index places in ListingOptions::box_um; null: all. `info` is the text of that of the skeletons; `volume` is called
// for a box. Throws InputError if nothing says what these choose among, or nothing is chosen; UsageError for unknown
// properties; IoError, also for a missing file of the spatial index.
ObjectIds chosenObjects(const SkeletonFiles& files, const std::string& info, const SegmentProperties* properties,
                        const std::function<SkeletonVolume()>& volume, const ListingOptions& options);

}  // namespace filiform::internal
