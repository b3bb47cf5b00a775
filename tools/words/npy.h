// Arrays in NumPy's .npy format, version 1.0: points in, records out. Functions without state.
#pragma once

#include "index/geometry/grid.h"

#include <array>
#include <bit>
#include <cstddef>
#include <functional>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace filiform::tools {

// Reads an array of N x 3 numbers: '<f8' or '<f4', in C or Fortran order, .npy version 1.0 or 2.0. One point may have
// the shape (3,). Throws Refusal: 400 for anything else, also for bytes after the array; 413 for more than `most`
// points. Never reads past `bytes`, and allocates after the sizes agree. O(bytes).
std::vector<Vector3d> readNpyPoints(std::string_view bytes, std::size_t most);

// The header of an array of `rows` records, or of rows of `columns` values. `type`: as Python writes it, such as
// "[('x', '<f8')]".
std::string npyHeader(const std::string& type, std::size_t rows, std::optional<std::size_t> columns = {});
std::string npyHeader(const std::string& type, const std::array<std::size_t, 3>& shape);
// The letters of a text in such an array, and their number. A byte that is no UTF-8 becomes U+FFFD.
std::size_t letterCount(std::string_view text);
void appendLetters(std::string& bytes, std::string_view text, std::size_t longest);
// An array of `rows` texts, text(0) to text(rows - 1): UCS-4, as wide as the longest. Calls text() twice for each row.
// O(rows * longest).
std::string npyOfTexts(std::size_t rows, const std::function<std::string_view(std::size_t row)>& text);
// Appends one value of a record, little-endian.
template <typename Value>
void appendValue(std::string& bytes, Value value) {
  static_assert(std::endian::native == std::endian::little, "records are written as they lie in memory");
  bytes.append(reinterpret_cast<const char*>(&value), sizeof value);
}

}  // namespace filiform::tools
