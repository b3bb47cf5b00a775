// The version of the headers, as numbers. What a consumer links against says its own: filiform_version() of filiform.h,
// or `filiform --version`. Before 1.0, a new minor version may change what the public headers declare; a new patch may
// not.
//
//   #if FILIFORM_VERSION_NUMBER >= 200  // 0.2.0
//
// Thread rule: constants.
#pragma once

// The three parts of the version.
#define FILIFORM_VERSION_MAJOR 0
#define FILIFORM_VERSION_MINOR 2
#define FILIFORM_VERSION_PATCH 0
// For comparisons: major * 10000 + minor * 100 + patch.
#define FILIFORM_VERSION_NUMBER (FILIFORM_VERSION_MAJOR * 10000 + FILIFORM_VERSION_MINOR * 100 + FILIFORM_VERSION_PATCH)
