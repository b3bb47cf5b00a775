// Writes cells of a set in other formats: what `filiform export` and Set.export() of Python do. Thread rule: one thread
// at a time; the functions of the caller are called on the calling thread.
#pragma once

#include <atomic>
#include <cstdint>
#include <functional>
#include <string>
#include <vector>

namespace filiform {
class TileSet;
}

namespace filiform::tools {

// Where the ending of an output leads.
struct ExportPlace {
  enum class Kind { kFile, kFolder, kZip, kSkeletons, kShards };
  enum class Format { swc, edges, obj, vtk };
  Kind kind = Kind::kFile;
  Format format = Format::swc;  // for kFile
};
// `format`: as CellExport has it. Throws UsageError for an ending or a format that is unknown, and for a format that
// does not belong to the place.
ExportPlace exportPlaceOf(const std::string& output, const std::string& format);

struct CellExport {
  const TileSet& set;
  std::string name;                                    // of the set: its folder or address
  std::vector<std::uint32_t> cells;                    // ids, each once
  std::vector<std::uint16_t> types{};                  // only samples of these; empty: all
  std::string output;                                  // FILE, DIR/, ARCHIVE.zip or DIR.precomputed
  std::string format{};                                // swc, edges, obj, vtk, precomputed; empty: by the output
  std::function<void()> check{};                       // called now and then; its exceptions end the export
  std::function<void(std::uint64_t done)> progress{};  // cells written
  const std::atomic<bool>* cancel = nullptr;           // stops waiting for a pipe's reader
};

// Returns the number of samples written. A failure leaves what was there. Throws UsageError for no cell, for several
// cells in one file and for an output that is a file of the set, InputError for a folder with files, and what reading
// and writing throw. O(segments of the tiles of the cells).
std::uint64_t exportCells(const CellExport& exported, const ExportPlace& place);

}  // namespace filiform::tools
