// Reads SWC text into a Cell, as lenient as can be without guessing, and says exactly what it did (input_report.h).
//
// All forms that curated archives use are read: any blanks and line ends, forests, unordered, gapped or restarted ids,
// exponents. A bad type, radius or parent degrades that field, never the sample. No recursion over samples, no locale,
// memory bounded by the cell: comment lines of any length are streamed, a data line holds at most 64 KiB.
// Thread-compatible: one reader a thread.
//
//   Cell cell;
//   const InputReport report = readSwc(text, "cell.swc", {}, cell);
#pragma once

#include "index/cell.h"
#include "index/input_report.h"

#include <cstddef>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <string_view>

namespace filiform {

struct SwcOptions {
  // One unit of the file in um: 1e-3 for nm. Multiplies positions and radii; other than 1 it answers W_UNITS.
  double unit_um = 1;
  // The size of a voxel instead, where it differs by axis. Radii, which have no axis, then stay as they are.
  std::optional<Vector3d> voxel_um = {};
  // Add the `# OFFSET` of the header (in file units) to the positions that follow it; answers its W_HEADER_SCALE.
  bool apply_offset = false;
  // Refuse the whole input on any W_ code.
  bool strict = false;

  bool isMicrometres() const { return unit_um == 1 && !voxel_um; }
  Vector3d toMicrometres(const Vector3d& p) const {
    return voxel_um ? Vector3d(p.cwiseProduct(*voxel_um)) : p * unit_um;
  }
  double radius_um() const { return voxel_um ? 1 : unit_um; }  // of a radius of 1
  void check() const;  // throws UsageError unless every unit is finite and above 0
};

class SwcReader {
 public:
  static constexpr std::size_t kMaxDataLine = 65536;  // bytes without the line end; comments are unlimited

  // Throws as options.check().
  explicit SwcReader(const SwcOptions& options = {});
  ~SwcReader();
  SwcReader(SwcReader&&) noexcept;
  SwcReader& operator=(SwcReader&&) noexcept;

  // The next bytes of the input, cut anywhere. O(bytes) expected.
  void feed(std::string_view bytes);

  // Ends the input: fills `cell` (all but `source`; without samples if refused, the digest is set in any case), and is
  // ready for the next input. `file` names the input in errors only. Throws ConservationError if the counts do not
  // balance, InputError beyond 2^32-2 samples. O(samples).
  InputReport finish(std::string_view file, Cell& cell);

  // Kept so far of what was fed since the last finish().
  std::uint64_t samples() const;
  // Memory that the reader takes for these until finish() is over; `times`: with that many times as many samples.
  std::uint64_t held_bytes(double times = 1) const;
  // Forgets what was fed since the last finish().
  void discard();

 private:
  struct State;
  std::unique_ptr<State> state_;
};

// Reads a whole text. Throws as SwcReader::finish.
InputReport readSwc(std::string_view text, std::string_view file, const SwcOptions& options, Cell& cell);

// Reads a file in blocks with `reader`; `progress`, if any, is told the bytes of each block. Throws IoError naming
// `path` when it cannot be opened or read, what `progress` throws, and as SwcReader::finish.
InputReport readSwcFile(const std::string& path, SwcReader& reader, Cell& cell,
                        const std::function<void(std::uint64_t bytes)>& progress = {});

}  // namespace filiform
