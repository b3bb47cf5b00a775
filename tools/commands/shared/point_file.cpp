#include "tools/commands/shared/point_file.h"

#include "index/errors.h"
#include "index/query/nearest.h"
#include "index/text.h"
#include "tools/words/numbers.h"

#include <algorithm>
#include <cerrno>
#include <fstream>
#include <iostream>
#include <iterator>
#include <sstream>
#include <string_view>

namespace filiform::tools {

Vector3d pointOfWords(const std::vector<std::string>& words, const std::string& before) {
  Vector3d point;
  for (int axis = 0; axis < 3; ++axis)  // in this order, so that the first wrong one is named
    point[axis] = parseNumber(before + "xyz"[axis], words.at(static_cast<std::size_t>(axis)));
  return point;
}

namespace {

constexpr std::string_view kByteOrderMark = "\xef\xbb\xbf";

std::vector<Vector3d> readLines(std::istream& in, const std::string& name) {
  std::vector<Vector3d> points;
  std::string line;
  for (std::size_t number = 1; std::getline(in, line); ++number) {
    if (number == 1 && line.starts_with(kByteOrderMark)) line.erase(0, kByteOrderMark.size());
    line.erase(std::min(line.find('#'), line.size()));
    for (char& c : line)
      if (c == ',' || c == '\t' || c == '\r') c = ' ';
    std::istringstream words(line);
    const std::vector<std::string> fields{std::istream_iterator<std::string>(words), {}};
    if (fields.empty()) continue;
    const std::string where = name + ":" + std::to_string(number);
    if (fields.size() != 3) throw UsageError(where + ": " + counted(fields.size(), "field") + "; give three: x y z");
    points.push_back(pointOfWords(fields, where + ": "));
    if (points.back().cwiseAbs().maxCoeff() > Nearest::kMaxCoordinate_um)
      throw UsageError(where + ": coordinates must lie within 1e150 um");
  }
  if (in.bad()) throw IoError(name, "cannot read");
  return points;
}

}  // namespace

std::vector<Vector3d> readPoints(const std::string& file) {
  if (file == "-") return readLines(std::cin, "stdin");
  std::ifstream in(file);
  if (!in) throw IoError(inShort(file), "cannot open", errno);
  return readLines(in, inShort(file));
}

}  // namespace filiform::tools
