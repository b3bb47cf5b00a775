#include "tools/words/npy.h"

#include "index/text.h"
#include "tools/words/refusal.h"

#include <algorithm>
#include <charconv>
#include <cstdint>
#include <cstring>
#include <optional>

namespace filiform::tools {

namespace {

constexpr std::string_view kNpyMagic("\x93NUMPY", 6);

[[noreturn]] void refuseNpy(const std::string& what) {
  throw Refusal(400, "the .npy body " + what + "; send an array of N x 3 numbers, '<f8' or '<f4'");
}

// Reads the Python dictionary of the header: descr, fortran_order, shape; each once, in any order.
class NpyHeader {
 public:
  explicit NpyHeader(std::string_view text) : text_(text) {
    expect('{');
    while (!accept('}')) {
      const std::string_view name = quotedText();
      expect(':');
      if (name == "descr" && !descr) {
        descr = quotedText();
      } else if (name == "fortran_order" && !fortran) {
        fortran = accept("True");
        if (!*fortran && !accept("False")) refuseNpy("has a wrong fortran_order");
      } else if (name == "shape" && !shape) {
        shape = numbers();
      } else {
        refuseNpy("has an unknown or repeated field in its header");
      }
      if (!accept(',')) {
        expect('}');
        break;
      }
    }
    skip();
    if (!text_.empty() || !descr || !fortran || !shape) refuseNpy("has a wrong header");
  }

  std::optional<std::string_view> descr;
  std::optional<bool> fortran;
  std::optional<std::vector<std::uint64_t>> shape;

 private:
  void skip() { text_.remove_prefix(std::min(text_.find_first_not_of(" \t\r\n"), text_.size())); }
  bool accept(char c) { return accept(std::string_view(&c, 1)); }
  bool accept(std::string_view word) {
    skip();
    if (!text_.starts_with(word)) return false;
    text_.remove_prefix(word.size());
    return true;
  }
  void expect(char c) {
    if (!accept(c)) refuseNpy("has a wrong header");
  }
  std::string_view quotedText() {
    const char quote = accept('\'') ? '\'' : '"';
    if (quote == '"') expect('"');
    const std::size_t end = text_.find(quote);
    if (end == std::string_view::npos) refuseNpy("has a wrong header");
    const std::string_view inside = text_.substr(0, end);
    text_.remove_prefix(end + 1);
    return inside;
  }
  std::vector<std::uint64_t> numbers() {
    std::vector<std::uint64_t> list;
    expect('(');
    while (!accept(')')) {
      skip();
      std::uint64_t value = 0;
      const auto [end, error] = std::from_chars(text_.data(), text_.data() + text_.size(), value);
      if (error != std::errc{} || list.size() == 3) refuseNpy("has a wrong shape");
      text_.remove_prefix(static_cast<std::size_t>(end - text_.data()));
      list.push_back(value);
      if (!accept(',')) {
        expect(')');
        break;
      }
    }
    return list;
  }

  std::string_view text_;
};

template <typename Number>
void copyPoints(std::string_view data, bool fortran, std::vector<Vector3d>& points) {
  const std::size_t rows = points.size();
  for (std::size_t i = 0; i < rows; ++i)
    for (std::size_t axis = 0; axis < 3; ++axis) {
      Number value;
      std::memcpy(&value, data.data() + (fortran ? axis * rows + i : i * 3 + axis) * sizeof value, sizeof value);
      points[i][static_cast<Eigen::Index>(axis)] = static_cast<double>(value);
    }
}

}  // namespace

std::vector<Vector3d> readNpyPoints(std::string_view bytes, std::size_t most) {
  const auto byte = [&](std::size_t i) { return static_cast<std::size_t>(static_cast<unsigned char>(bytes[i])); };
  if (bytes.size() < 10 || !bytes.starts_with(kNpyMagic)) refuseNpy("does not begin as .npy does");
  const std::size_t version = byte(6);
  if ((version != 1 && version != 2) || byte(7) != 0) refuseNpy("has a version other than 1.0 and 2.0");
  if (version == 2 && bytes.size() < 12) refuseNpy("ends within its header");
  const std::size_t start = version == 1 ? 10 : 12;
  std::size_t length = byte(8) | byte(9) << 8;
  if (version == 2) length |= byte(10) << 16 | byte(11) << 24;
  if (length > bytes.size() - start) refuseNpy("ends within its header");
  const NpyHeader header(bytes.substr(start, length));

  const std::vector<std::uint64_t>& shape = *header.shape;
  const bool one = shape.size() == 1 && shape[0] == 3;
  if (!one && (shape.size() != 2 || shape[1] != 3)) refuseNpy("has a wrong shape");
  const std::uint64_t rows = one ? 1 : shape[0];
  if (rows > most)
    throw Refusal(413,
                  "the .npy body has more than " + std::to_string(most) + " points; send them in several requests");
  const bool wide = *header.descr == "<f8";
  if (!wide && *header.descr != "<f4") refuseNpy("has another type of number");
  const std::string_view data = bytes.substr(start + length);
  if (data.size() != rows * 3 * (wide ? sizeof(double) : sizeof(float)))
    refuseNpy("has another size than its shape says");
  std::vector<Vector3d> points(rows);
  wide ? copyPoints<double>(data, *header.fortran && !one, points)
       : copyPoints<float>(data, *header.fortran && !one, points);
  return points;
}

namespace {

std::string headerOf(const std::string& type, const std::string& shape) {
  std::string text = "{'descr': " + type + ", 'fortran_order': False, 'shape': (" + shape + "), }";
  // The data begin at a multiple of 64.
  text.append(63 - (10 + text.size()) % 64, ' ');
  text += '\n';
  std::string header(kNpyMagic);
  header += {'\x01', '\x00', static_cast<char>(text.size() & 0xFF), static_cast<char>(text.size() >> 8)};
  return header + text;
}

}  // namespace

std::string npyHeader(const std::string& type, std::size_t rows, std::optional<std::size_t> columns) {
  return headerOf(type, std::to_string(rows) + "," + (columns ? std::to_string(*columns) : ""));
}

std::string npyHeader(const std::string& type, const std::array<std::size_t, 3>& shape) {
  return headerOf(type, std::to_string(shape[0]) + "," + std::to_string(shape[1]) + "," + std::to_string(shape[2]));
}

std::size_t letterCount(std::string_view text) {
  std::size_t letters = 0;
  for (; !text.empty(); ++letters) text.remove_prefix(std::max<std::size_t>(decodeUtf8(text).length, 1));
  return letters;
}

void appendLetters(std::string& bytes, std::string_view text, std::size_t longest) {
  for (std::size_t i = 0; i < longest; ++i) {
    std::uint32_t letter = 0;
    if (!text.empty()) {
      const Utf8Character character = decodeUtf8(text);
      letter = character.length == 0 ? 0xFFFD : static_cast<std::uint32_t>(character.code_point);
      text.remove_prefix(std::max<std::size_t>(character.length, 1));
    }
    appendValue(bytes, letter);
  }
}

std::string npyOfTexts(std::size_t rows, const std::function<std::string_view(std::size_t row)>& text) {
  std::size_t longest = 1;
  for (std::size_t row = 0; row < rows; ++row) longest = std::max(longest, letterCount(text(row)));
  std::string bytes = npyHeader("'<U" + std::to_string(longest) + "'", rows);
  for (std::size_t row = 0; row < rows; ++row) appendLetters(bytes, text(row), longest);
  return bytes;
}

}  // namespace filiform::tools
