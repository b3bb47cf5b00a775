#include "index/formats/internal/vtk_polylines.h"

#include "index/file/internal/byte_stream.h"
#include "index/formats/internal/graph_builder.h"
#include "index/formats/swc/internal/swc_fields.h"

#include <algorithm>
#include <array>
#include <bit>
#include <charconv>
#include <cmath>
#include <cstring>
#include <string>
#include <vector>

namespace filiform {
namespace {

using internal::RealKind;

constexpr std::uint64_t kMaxCount = std::uint64_t{1} << 40;

// Why the file is refused; thrown and caught only in this file.
struct NotVtk {
  std::string token;
};

std::string upper(std::string_view text) {
  std::string out(text);
  std::transform(out.begin(), out.end(), out.begin(), [](char c) { return c >= 'a' && c <= 'z' ? char(c - 32) : c; });
  return out;
}

struct DataType {
  std::size_t bytes = 0;  // 0: not a number type
  bool real = false, is_signed = false;
};

DataType dataTypeOf(std::string_view name) {
  struct Named {
    std::string_view name;
    DataType type;
  };
  static constexpr std::array<Named, 17> kTypes = {{{"FLOAT", {4, true, true}},
                                                    {"DOUBLE", {8, true, true}},
                                                    {"CHAR", {1, false, true}},
                                                    {"SIGNED_CHAR", {1, false, true}},
                                                    {"UNSIGNED_CHAR", {1, false, false}},
                                                    {"SHORT", {2, false, true}},
                                                    {"UNSIGNED_SHORT", {2, false, false}},
                                                    {"INT", {4, false, true}},
                                                    {"UNSIGNED_INT", {4, false, false}},
                                                    {"LONG", {8, false, true}},
                                                    {"UNSIGNED_LONG", {8, false, false}},
                                                    {"VTKIDTYPE", {4, false, true}},
                                                    {"VTKTYPEINT32", {4, false, true}},
                                                    {"VTKTYPEUINT32", {4, false, false}},
                                                    {"VTKTYPEINT64", {8, false, true}},
                                                    {"VTKTYPEUINT64", {8, false, false}},
                                                    {"VTKTYPEINT8", {1, false, true}}}};
  const std::string wanted = upper(name);
  for (const Named& type : kTypes)
    if (type.name == wanted) return type.type;
  return {};
}

class VtkReader {
 public:
  VtkReader(internal::ByteStream& in, internal::GraphBuilder& graph) : in_(in), graph_(graph) {}

  void read() {
    readHeader();
    for (std::string_view token; in_.readToken(token, true);) {
      const std::string word = upper(token);
      if (word == "POINTS") {
        readPoints();
      } else if (word == "LINES") {
        readCells(true);
      } else if (word == "VERTICES" || word == "POLYGONS" || word == "TRIANGLE_STRIPS") {
        graph_.remark(InputCode::W_ELEMENT, in_.line(), word);
        readCells(false);
      } else if (word == "POINT_DATA" || word == "CELL_DATA") {
        of_points_ = word == "POINT_DATA";
        tuples_ = count();
      } else if (word == "FIELD") {
        readField();
      } else if (word == "METADATA") {
        skipMetadata();
      } else if (!skipData(word)) {
        // After an unknown keyword, no word is certain to be a keyword.
        if (!seen_points_ || !seen_lines_) throw NotVtk{word};
        graph_.remark(InputCode::W_ELEMENT, in_.line(), word);
        break;
      }
    }
    if (!seen_points_) throw NotVtk{"no POINTS"};
  }

 private:
  std::string word() {
    std::string_view token;
    if (!in_.readToken(token, true)) throw NotVtk{"ends too soon"};
    return upper(token);
  }
  std::uint64_t count() {
    const std::string text = word();
    std::uint64_t value = 0;
    const auto [stop, error] = std::from_chars(text.data(), text.data() + text.size(), value);
    if (error != std::errc() || stop != text.data() + text.size() || value > kMaxCount) throw NotVtk{text};
    return value;
  }
  DataType type() {
    const std::string name = word();
    const DataType type = dataTypeOf(name);
    if (type.bytes == 0) throw NotVtk{name};
    return type;
  }
  // Binary data begin after the line end of their keyword.
  void beginData() {
    if (!binary_) return;
    std::string_view rest;
    bool too_long = false;
    in_.readLine(rest, internal::ByteStream::kMaxToken, too_long);
  }

  void readHeader() {
    std::string_view line;
    bool too_long = false;
    constexpr std::string_view kMagic = "# vtk DataFile Version ";
    if (!in_.readLine(line, 256, too_long) || !line.starts_with(kMagic)) throw NotVtk{std::string(line.substr(0, 40))};
    offsets_ = line.size() > kMagic.size() && line[kMagic.size()] >= '5' && line[kMagic.size()] <= '9';
    in_.readLine(line, 256, too_long);  // a title
    const std::string form = word();
    if (form != "ASCII" && form != "BINARY") throw NotVtk{form};
    binary_ = form == "BINARY";
    std::string next = word();
    if (next == "FIELD") {
      readField();
      next = word();
    }
    const std::string kind = word();
    if (next != "DATASET" || kind != "POLYDATA") throw NotVtk{kind};
  }

  // Reads one number. In ASCII, any text but a finite number gives HUGE_VAL; readable_ is false unless it means NaN or
  // infinity.
  double real(const DataType& type) {
    readable_ = true;
    if (binary_) return binaryNumber(type);
    std::string_view token;
    if (!in_.readToken(token, true)) throw NotVtk{"ends too soon"};
    double value = 0;
    const RealKind kind = internal::readReal(token, value);
    readable_ = kind != RealKind::kText;
    return kind == RealKind::kFinite ? value : HUGE_VAL;
  }
  double binaryNumber(const DataType& type) {
    const std::uint64_t bits = bigEndian(type.bytes);
    if (type.real)
      return type.bytes == 4 ? double(std::bit_cast<float>(static_cast<std::uint32_t>(bits)))
                             : std::bit_cast<double>(bits);
    return type.is_signed ? double(signExtended(bits, type.bytes)) : double(bits);
  }
  std::uint64_t bigEndian(std::size_t bytes) {
    std::array<unsigned char, 8> raw{};
    if (!in_.read(raw.data(), bytes)) throw NotVtk{"ends too soon"};
    std::uint64_t bits = 0;
    for (std::size_t i = 0; i < bytes; ++i) bits = bits << 8 | raw[i];
    return bits;
  }
  static std::int64_t signExtended(std::uint64_t bits, std::size_t bytes) {
    const int shift = static_cast<int>(64 - 8 * bytes);
    return static_cast<std::int64_t>(bits << shift) >> shift;
  }
  // Reads an index or a count. Other text gives -1.
  std::int64_t integer(const DataType& type) {
    if (binary_) {
      const std::uint64_t bits = bigEndian(type.bytes);
      return type.is_signed ? signExtended(bits, type.bytes) : bits > kMaxCount ? -1 : static_cast<std::int64_t>(bits);
    }
    std::string_view token;
    if (!in_.readToken(token, true)) throw NotVtk{"ends too soon"};
    std::int64_t value = 0;
    const auto [stop, error] = std::from_chars(token.data(), token.data() + token.size(), value);
    return error == std::errc() && stop == token.data() + token.size() ? value : -1;
  }
  void skipNumbers(std::uint64_t n, std::size_t bytes) {
    if (binary_) {
      if (!in_.skip(n * bytes)) throw NotVtk{"ends too soon"};
      return;
    }
    std::string_view token;
    for (std::uint64_t i = 0; i < n; ++i)
      if (!in_.readToken(token, true)) throw NotVtk{"ends too soon"};
  }
  std::uint64_t place(std::uint64_t index) const { return binary_ ? index + 1 : in_.line(); }

  void readPoints() {
    if (seen_points_) throw NotVtk{"POINTS twice"};
    seen_points_ = true;
    points_ = count();
    const DataType number = type();
    beginData();
    for (std::uint64_t i = 0; i < points_; ++i) {
      Vector3d position;
      bool good = true;
      for (int axis = 0; axis < 3; ++axis) {
        position[axis] = real(number);
        good &= readable_;
      }
      const std::string token = "point " + std::to_string(i);
      if (good) {
        graph_.node(static_cast<std::int64_t>(i), position, std::nan(""), 0, place(i), token);
      } else {
        graph_.dropNode(InputCode::W_BAD_LINE, place(i), token);
      }
    }
  }

  void readCells(bool lines) {
    seen_lines_ |= lines;
    const std::uint64_t a = count(), b = count();
    if (offsets_) return readOffsetCells(lines, a, b);
    const DataType number = {4, false, true};
    beginData();
    std::uint64_t left = b;
    for (std::uint64_t cell = 0; cell < a; ++cell) {
      const std::int64_t n = integer(number);
      if (n < 0 || left == 0 || static_cast<std::uint64_t>(n) > left - 1) throw NotVtk{"counts of LINES do not add up"};
      left -= static_cast<std::uint64_t>(n) + 1;
      if (!lines) {
        skipNumbers(static_cast<std::uint64_t>(n), number.bytes);
        continue;
      }
      begin_ = true;
      for (std::int64_t i = 0; i < n; ++i) end(integer(number));
    }
    if (left != 0) throw NotVtk{"counts of LINES do not add up"};
  }

  // Version 5: the offsets of each line in the list of points and the end, then the list.
  void readOffsetCells(bool lines, std::uint64_t offset_count, std::uint64_t size) {
    if (offset_count == 0 && size == 0) return;
    const std::string offsets_word = word();
    if (offsets_word != "OFFSETS") throw NotVtk{offsets_word};
    const DataType offset_type = type();
    beginData();
    std::vector<std::uint64_t> offsets;
    for (std::uint64_t i = 0; i < offset_count; ++i) {
      const std::int64_t at = integer(offset_type);
      if (at < 0 || static_cast<std::uint64_t>(at) > size ||
          (offsets.empty() ? at != 0 : static_cast<std::uint64_t>(at) < offsets.back()))
        throw NotVtk{"OFFSETS out of order"};
      offsets.push_back(static_cast<std::uint64_t>(at));
    }
    if (offsets.empty() || offsets.back() != size) throw NotVtk{"OFFSETS do not end at the size"};
    const std::string connectivity = word();
    if (connectivity != "CONNECTIVITY") throw NotVtk{connectivity};
    const DataType number = type();
    beginData();
    if (!lines) return skipNumbers(size, number.bytes);
    std::size_t cell = 0;
    for (std::uint64_t i = 0; i < size; ++i) {
      while (offsets[cell] == i && cell + 1 < offsets.size()) {
        begin_ = true;
        ++cell;
      }
      end(integer(number));
    }
  }

  // Adds the next point of a line.
  void end(std::int64_t point) {
    if (!begin_) graph_.link(before_, point, place(links_++));
    begin_ = false;
    before_ = point;
  }

  void readField() {
    word();  // its name
    const std::uint64_t arrays = count();
    for (std::uint64_t i = 0; i < arrays; ++i) {
      std::string name = word();
      if (name == "METADATA") {
        skipMetadata();
        name = word();
      }
      const std::uint64_t components = count(), tuples = count();
      const DataType number = type();
      readArray(name, number, components, tuples);
    }
  }

  void readArray(const std::string& name, const DataType& number, std::uint64_t components, std::uint64_t tuples) {
    if (components > 1024) throw NotVtk{name};
    beginData();
    const bool radii = of_points_ && seen_points_ && components == 1 && tuples == points_ &&
                       (name == "RADIUS" || name == "RADII" || name == "MAXIMUMINSCRIBEDSPHERERADIUS");
    if (!radii) return skipNumbers(components * tuples, number.bytes);
    for (std::uint64_t i = 0; i < tuples; ++i) {
      const double radius = real(number);
      graph_.setRadius(static_cast<std::int64_t>(i), readable_ ? radius : -1, place(i));
    }
  }

  void skipMetadata() {
    std::string_view line;
    bool too_long = false;
    in_.readLine(line, 256, too_long);
    while (in_.readLine(line, 256, too_long) && line.find_first_not_of(" \t") != std::string_view::npos) {
    }
  }

  // Skips data of points or cells other than fields. Returns false for an unknown keyword.
  bool skipData(const std::string& keyword) {
    if (keyword == "SCALARS") {
      const std::string name = word();
      const DataType number = type();
      std::uint64_t components = 1;
      std::string_view token;
      if (in_.readToken(token, false)) {
        const auto [stop, error] = std::from_chars(token.data(), token.data() + token.size(), components);
        if (error != std::errc() || stop != token.data() + token.size()) throw NotVtk{name};
      }
      const std::string table = word();
      if (table != "LOOKUP_TABLE") throw NotVtk{table};
      word();
      readArray(name, number, components, tuples_);
    } else if (keyword == "LOOKUP_TABLE") {
      word();
      const std::uint64_t n = count();
      beginData();
      skipNumbers(4 * n, 1);
    } else if (keyword == "COLOR_SCALARS") {
      word();
      const std::uint64_t components = count();
      beginData();
      if (components > 1024) throw NotVtk{keyword};
      skipNumbers(components * tuples_, 1);
    } else if (keyword == "TEXTURE_COORDINATES") {
      const std::string name = word();
      const std::uint64_t components = count();
      readArray(name + " ", type(), components, tuples_);
    } else if (keyword == "VECTORS" || keyword == "NORMALS" || keyword == "TENSORS" || keyword == "TENSORS6" ||
               keyword == "GLOBAL_IDS" || keyword == "PEDIGREE_IDS") {
      const std::string name = word();
      const std::uint64_t components = keyword == "TENSORS"       ? 9
                                       : keyword == "TENSORS6"    ? 6
                                       : keyword.ends_with("IDS") ? 1
                                                                  : 3;
      readArray(name + " ", type(), components, tuples_);
    } else {
      return false;
    }
    return true;
  }

  internal::ByteStream& in_;
  internal::GraphBuilder& graph_;
  bool binary_ = false, offsets_ = false;
  bool seen_points_ = false, seen_lines_ = false, of_points_ = false;
  bool readable_ = true;  // false after a field that is no number
  std::uint64_t points_ = 0, tuples_ = 0, links_ = 0;
  bool begin_ = true;
  std::int64_t before_ = 0;
};

}  // namespace

void readVtkPolylines(internal::ByteStream& in, internal::GraphBuilder& graph) {
  try {
    VtkReader(in, graph).read();
  } catch (const NotVtk& why) {
    graph.refuse(InputCode::E_FORMAT, in.line(), why.token);
  }
}

}  // namespace filiform
