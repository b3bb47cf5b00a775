// What a file holds, by its name, and by its beginning where the name leaves it open. Thread rule: pure functions, any
// thread.
#pragma once

#include <cstddef>
#include <cstdint>
#include <string_view>

namespace filiform::internal {

enum class FileKind : std::uint8_t {
  cell,  // SWC or a graph
  zip,
  tar,
  tar_gz,
  mouselight,
  catmaid,
  nml,
  h5,
  shard,    // of skeletons
  objects,  // unsharded skeletons at an address
};

// By the ending, in any letter case; `cell` for every ending that is not known. .json: mouselight, .csv: catmaid, .nml
// and .xml: nml. O(length).
FileKind kindOf(std::string_view path);

// Whether a file of this name holds SWC: *.swc, *.eswc (as Vaa3D writes), *.swc.txt. O(1).
bool namesSwc(std::string_view path);

// Whether a file of this name is read in folders and archives. Files that may hold other things, such as *.json, must
// also begin as mayHoldCells() says.
bool isReadInFolders(std::string_view path);
inline bool mustBeginRight(FileKind kind) {
  return kind == FileKind::mouselight || kind == FileKind::catmaid || kind == FileKind::nml || kind == FileKind::h5;
}
inline constexpr std::size_t kHeadBytes = 4096;
bool mayHoldCells(FileKind kind, std::string_view head);

}  // namespace filiform::internal
