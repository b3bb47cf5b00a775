// The spatial index of Neuroglancer skeletons, as igneous writes it and CloudVolume reads it: the volume is cut into
// chunks of one size, and beside the skeletons lies a file x0-x1_y0-y1_z0-z1.spatial for each, named by its bounds in
// nm. It states the bounds of each object in the chunk: {"ID": [x0, y0, z0, x1, y1, z1]}, nm. Thread rule: immutable.
#pragma once

#include <array>
#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

namespace filiform {

using Box_nm = std::array<std::array<double, 3>, 2>;  // lowest and highest corner

class SpatialIndex {
 public:
  static constexpr std::uint64_t kMaxBytes = std::uint64_t{1} << 26;  // of one file
  static constexpr std::uint64_t kMostFiles = 65536;                  // of one box

  // `skeletons` is the info of the skeletons, with `spatial_index`; `volume` is that of the volume, whose `scales`
  // state its bounds: that of the index's resolution, else that of `mip`, else the first. Throws InputError naming
  // `file` or `volume_file` for an info that states none of this.
  SpatialIndex(std::string_view skeletons, const std::string& file, std::string_view volume,
               const std::string& volume_file);

  // The files of the chunks that meet the box. Throws InputError naming the info for more than kMostFiles. O(result).
  std::vector<std::string> filesIn(const Box_nm& box) const;
  // Appends the objects of a file whose bounds meet the box, in any order. Throws InputError naming `file` if it is not
  // such a file. O(length).
  static void objectsIn(const Box_nm& box, std::string_view json, const std::string& file,
                        std::vector<std::uint64_t>& ids);

 private:
  std::string file_;
  Box_nm bounds_{};
  std::array<double, 3> chunk_nm_{};
  int decimals_ = 0;  // of the numbers in names
};

}  // namespace filiform
