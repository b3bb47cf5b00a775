// Reads SWC text into a Cell and reports exactly what was kept, dropped or changed (input_report.h).
//
// Reads all forms found in curated archives: any blanks and line ends, forests, unordered, gapped or restarted ids,
// exponents. A bad type, radius or parent loses that field, never the sample. Nothing is guessed. There is no recursion
// over samples and no use of the locale. Memory is bounded by the cell: comment lines of any length are streamed, a
// data line holds at most 64 KiB. Thread rule: thread-compatible; one reader a thread.
//
//   Cell cell;
//   const InputReport report = readSwc(text, "cell.swc", {}, cell);
#pragma once

#include "index/cell/cell.h"
#include "index/reports/input_report.h"

#include <cstddef>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <string_view>

namespace filiform {

struct SwcOptions {
  // One unit of the file in um: 1e-3 for nm. Multiplies positions and radii. A value other than 1 suppresses W_UNITS.
  double unit_um = 1;
  // Size of a voxel in um by axis; replaces unit_um. Radii then stay unchanged, since they have no axis.
  std::optional<Vector3d> voxel_um = {};
  // Adds the `# OFFSET` of the header (in file units) to the positions after it. Suppresses W_HEADER_SCALE for that
  // line.
  bool apply_offset = false;
  // Refuse the whole input on any W_ code.
  bool strict = false;
  // For formats without links between the soma and the neurites (H5, ASC): add them, each a SOMA_LINK.
  bool soma_links = true;

  bool isMicrometres() const { return unit_um == 1 && !voxel_um; }
  Vector3d toMicrometres(const Vector3d& p) const {
    return voxel_um ? Vector3d(p.cwiseProduct(*voxel_um)) : p * unit_um;
  }
  double radius_um() const { return voxel_um ? 1 : unit_um; }  // um for one unit of radius
  void check() const;  // throws UsageError unless every unit is finite and above 0
};

class SwcReader {
 public:
  static constexpr std::size_t kMaxDataLine = 65536;  // bytes without the line end; comments are unlimited

  // Throws as options.check() does.
  explicit SwcReader(const SwcOptions& options = {});
  ~SwcReader();
  SwcReader(SwcReader&&) noexcept;
  SwcReader& operator=(SwcReader&&) noexcept;

  // Reads the next bytes of the input; blocks may end anywhere. O(bytes) expected.
  void feed(std::string_view bytes);

  // Ends the input and fills `cell`: all members except `source`. If the input is refused, `cell` has a digest but no
  // samples. The reader is then ready for the next input. `file` names the input in error messages. Throws
  // ConservationError if the counts disagree, InputError for more than 2^32-2 samples. O(samples).
  InputReport finish(std::string_view file, Cell& cell);

  // Samples kept since the last finish().
  std::uint64_t samples() const;
  // Memory, bytes, that the reader takes for them until finish() ends; `times`: with that many times as many samples.
  std::uint64_t held_bytes(double times = 1) const;
  // Discards the bytes fed since the last finish().
  void discard();

 private:
  struct State;
  std::unique_ptr<State> state_;
};

// Reads a whole text. Throws as SwcReader::finish() does.
InputReport readSwc(std::string_view text, std::string_view file, const SwcOptions& options, Cell& cell);

// Reads a file in blocks. `progress`, if given, receives the size of each block. Throws IoError naming `path` if the
// file cannot be opened or read; also what `progress` and SwcReader::finish() throw.
InputReport readSwcFile(const std::string& path, SwcReader& reader, Cell& cell,
                        const std::function<void(std::uint64_t bytes)>& progress = {});

}  // namespace filiform
