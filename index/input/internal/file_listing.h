// Lists the inputs that arguments name: files of folders, skeletons at addresses. Thread rule: pure functions.
#pragma once

#include "index/containers/internal/container.h"
#include "index/containers/internal/file_kind.h"
#include "index/containers/internal/skeleton_source.h"
#include "index/formats/internal/graph_file.h"
#include "index/formats/neuroglancer/internal/segment_properties.h"
#include "index/hdf5/internal/hdf5_process.h"
#include "index/input/internal/listing_options.h"

#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace filiform::internal {

struct ListedFile {
  std::string path;
  std::string shown;            // path below the argument
  std::string unreadable = {};  // why it cannot be read
  std::string not_read = {};    // of a file argument: its format, and what to do
  FileKind kind = FileKind::cell;
  bool packed = false;    // a cell in gzip
  bool left_out = false;  // the other version of its neuron is read
  bool found = false;     // in a folder: passed over if it holds no cell
  bool passed = false;    // is passed over
  // For a graph:
  std::optional<GraphFormat> format = {};
  std::shared_ptr<const SkeletonInfo> skeleton = {};
  std::shared_ptr<const SegmentProperties> properties = {};  // of skeletons; null: none
  std::optional<std::vector<std::string>> only = {};  // morphologies of an H5 file, ascending; others are left out
  // For shards and objects:
  std::shared_ptr<const SkeletonFiles> skeleton_files = {};
  ObjectIds ids = {};
};

// The file by its name, as a file argument: any ending that is not known is SWC. Of a .csv file, its beginning decides.
ListedFile fileArgument(const std::string& path, const std::string& shown);

// The row of an object that is not there, refused for this reason.
ListedFile missingObject(const SkeletonFiles& files, std::uint64_t id, const std::string& reason);

// The files of a folder of precomputed skeletons by id as text, or its shards; of another folder, all files by
// path (index/input/input.h); those that hold no cell are passed over. Throws InputError for a folder of skeletons
// without any, or with an `info` that cannot be used; IoError if the process has no file descriptor or memory left.
std::vector<ListedFile> listFiles(const std::string& folder, const ListingOptions& options);

// The address of skeletons: http, https, or s3 for an argument that begins so, or with gs://. `precomputed://` may
// stand before it and `|neuroglancer-precomputed:` behind it, as Neuroglancer writes them, and `middleauth+` before
// http, as CAVE does. gs:// is at the address in the variable STORAGE_EMULATOR_HOST, else at that of Google. Empty for
// other text. Throws UsageError for a malformed address, InputError for another format behind `|`.
std::string skeletonAddress(const std::string& argument);
// The shards, or all objects as one file, of the skeletons at an address, or of those that the info of a volume there
// names. Segment properties are those of the skeletons, else those of the volume. Ids are those of the options, else
// those of the segment properties; without both, all shards are asked for, and an unsharded source is refused. Throws
// InputError, IoError, and what filesAtAddress() throws.
std::vector<ListedFile> listAddress(const std::string& address, const ListingOptions& options);

// Lists the content of a file that holds many inputs; null for a cell. `hdf5` lists H5 files. `progress` is called
// between blocks. Throws IoError, and what `progress` throws.
std::unique_ptr<Container> openContainer(const ListedFile& file, Hdf5Process& hdf5,
                                         const std::function<void()>& progress);

}  // namespace filiform::internal
