#include "index/circuits/placements.h"

#include "index/cell/soma.h"
#include "index/count_text.h"
#include "index/errors.h"
#include "index/file/internal/digest.h"
#include "index/text.h"

#include <algorithm>
#include <cerrno>
#include <charconv>
#include <cmath>
#include <cstdio>
#include <fstream>
#include <numeric>
#include <tuple>

namespace filiform {
namespace {

constexpr std::array<std::string_view, 9> kColumns = {"source", "x_um", "y_um", "z_um", "qw", "qx", "qy", "qz", "name"};

bool readNumber(std::string_view text, double& value) {
  while (!text.empty() && text.front() == ' ') text.remove_prefix(1);
  while (!text.empty() && text.back() == ' ') text.remove_suffix(1);
  if (text.size() > 1 && text.front() == '+') text.remove_prefix(1);
  const char* end = text.data() + text.size();
  const auto [stop, error] = std::from_chars(text.data(), end, value);
  value += 0.0;  // -0 and 0 give the same placement
  return error == std::errc() && stop == end && std::isfinite(value);
}

// Rows 0..2 of the rotation matrix. Written out, so that the order of sums is independent of library versions.
std::array<std::array<double, 3>, 3> rotationOf(const std::array<double, 4>& q) {
  const auto [w, x, y, z] = q;
  return {{{1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)},
           {2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)},
           {2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)}}};
}

constexpr double kSomaAtOrigin_um = 1;  // a soma within this distance is not remarked

// Where the soma of a morphology lies: the mean of its samples of type 1. The origin if there are none. The mean of an
// outline of many samples is not exactly the soma's centre: if the origin lies within the outline, it is taken instead.
Vector3d somaPlace(const Cell& morphology) {
  Vector3d sum = Vector3d::Zero();
  std::vector<Vector3d> soma;
  for (std::size_t i = 0; i < morphology.samples(); ++i) {
    if (morphology.types[i] != kSomaType) continue;
    soma.push_back(morphology.positions_um[i]);
    sum += soma.back();
  }
  if (soma.empty()) return sum;
  const Vector3d mean = sum / static_cast<double>(soma.size());
  double reach = 0;
  for (const Vector3d& p : soma) reach = std::max(reach, (p - mean).norm());
  return soma.size() > 3 && mean.norm() < reach ? Vector3d(Vector3d::Zero()) : mean;
}

std::uint64_t digestOf(const PlacementTable::Row& row, std::string_view text, std::uint64_t seed) {
  std::array<double, 7> pose;
  std::copy(row.moved_um.begin(), row.moved_um.end(), pose.begin());
  std::copy(row.turned.begin(), row.turned.end(), pose.begin() + 3);
  const std::uint64_t placed = internal::checksum(
      std::string_view(reinterpret_cast<const char*>(pose.data()), sizeof pose), row.by_soma ? ~seed : seed);
  return internal::checksum(text, placed);
}

}  // namespace

class PlacementTable::Parser {
 public:
  explicit Parser(PlacementTable& table) : table_(table) {}

  void line(std::string_view text) {
    ++line_;
    if (line_ == 1 && text.substr(0, 3) == "\xEF\xBB\xBF") text.remove_prefix(3);
    if (!text.empty() && text.back() == '\r') text.remove_suffix(1);
    if (text.find_first_not_of(" \t") == std::string_view::npos) return;
    if (text.size() > kMaxLine) fail("the line is longer than " + std::to_string(kMaxLine) + " bytes");
    const std::size_t columns = split(text);
    if (!has_header_) {
      if (columns != kColumns.size() || fields_ != kColumns)
        fail("expected the header line `source x_um y_um z_um qw qx qy qz name`, separated by tabs");
      has_header_ = true;
      return;
    }
    // Some editors remove a tab at the end of a line.
    if (columns + 1 < kColumns.size() || columns > kColumns.size())
      fail("has " + counted(columns, "column") + " instead of 9, separated by tabs");
    row();
  }

  void finish() {
    if (!has_header_) {
      line_ = 1;
      fail("expected the header line `source x_um y_um z_um qw qx qy qz name`, separated by tabs");
    }
  }

 private:
  [[noreturn]] void fail(const std::string& what) const {
    throw InputError(inShort(table_.file_) + ":" + std::to_string(line_) + ": " + what);
  }

  std::size_t split(std::string_view text) {
    fields_.fill({});
    for (std::size_t column = 0;; ++column) {
      const std::size_t tab = text.find('\t');
      if (column < fields_.size()) fields_[column] = text.substr(0, tab);
      if (tab == std::string_view::npos) return column + 1;
      text.remove_prefix(tab + 1);
    }
  }

  double number(std::size_t column) const {
    double value = 0;
    if (!readNumber(fields_[column], value))
      fail(std::string(kColumns[column]) + " is '" + escaped(fields_[column], 40) + "', not a finite number");
    return value;
  }

  void row() {
    if (fields_[0].empty()) fail("the source is empty");
    if (line_ > UINT32_MAX - 1) fail("the table has more than 2^32-2 lines");
    Row row{};
    row.line = static_cast<std::uint32_t>(line_);
    for (std::size_t i = 0; i < 3; ++i) row.moved_um[i] = number(1 + i);
    for (std::size_t i = 0; i < 4; ++i) row.turned[i] = number(4 + i);
    double square = 0;
    for (const double component : row.turned) square += component * component;
    const double length = std::sqrt(square);
    if (!(std::abs(length - 1) <= kLengthTolerance))
      fail("the quaternion qw qx qy qz has length " + std::to_string(length) + ", not 1");
    for (double& component : row.turned) component = component / length + 0.0;
    table_.add(fields_[0], fields_[8], row.line, row.moved_um, row.turned, false);
  }

  PlacementTable& table_;
  std::uint64_t line_ = 0;
  bool has_header_ = false;
  std::array<std::string_view, kColumns.size()> fields_;
};

void PlacementTable::add(std::string_view source, std::string_view name, std::uint32_t line,
                         const std::array<double, 3>& moved_um, const std::array<double, 4>& turned, bool by_soma) {
  Row row{};
  row.line = line;
  row.moved_um = moved_um;
  row.turned = turned;
  row.by_soma = by_soma;
  row.name_at = names_.size();
  row.name_bytes = static_cast<std::uint32_t>(name.size());
  names_ += name;
  const auto [at, added] = numbers_.try_emplace(std::string(source), static_cast<std::uint32_t>(sources_.size()));
  if (added) sources_.push_back(at->first);
  row.source = at->second;
  rows_.push_back(row);
  digest_ += digestOf(row, name, internal::checksum(source));
}

PlacementTable PlacementTable::parse(std::string_view text, const std::string& file) {
  PlacementTable table;
  table.file_ = file;
  table.bytes_ = text.size();
  Parser parser(table);
  while (!text.empty()) {
    const std::size_t end = text.find('\n');
    parser.line(text.substr(0, end));
    text.remove_prefix(end == std::string_view::npos ? text.size() : end + 1);
  }
  parser.finish();
  return table;
}

PlacementTable PlacementTable::read(const std::string& path) {
  PlacementTable table;
  const std::size_t slash = path.rfind('/');
  table.file_ = slash == std::string::npos ? path : path.substr(slash + 1);
  errno = 0;
  std::ifstream in(path, std::ios::binary);
  if (!in) throw IoError(inShort(path), "cannot read the table of placements", errno);
  Parser parser(table);
  std::string buffer(kMaxLine + 3, '\0');  // room for a byte order mark and a line end
  for (;;) {
    in.getline(buffer.data(), static_cast<std::streamsize>(buffer.size()));
    const auto got = static_cast<std::size_t>(in.gcount());
    if (in.bad()) throw IoError(inShort(path), "cannot read the table of placements", errno);
    table.bytes_ += got;
    if (in.fail() && got == 0) break;
    // Without room for the line end, getline fails. The parser then also finds the line too long.
    const bool ended = !in.eof() && !in.fail();
    parser.line(std::string_view(buffer).substr(0, got - ended));
    if (in.eof()) break;
  }
  parser.finish();
  return table;
}

PlacedCells::PlacedCells(Input& library, PlacementTable table) : library_(library), table_(std::move(table)) {
  library_.keepFilesWhole();
  const auto& sources = table_.sources();
  for (std::uint32_t s = 0; s < sources.size(); ++s) source_numbers_.emplace(sources[s], s);
  orderRows();
  std::vector<std::uint32_t> listed(sources.size(), 0);
  for (const std::string_view source : library_.sources()) {
    const auto found = source_numbers_.find(source);
    if (found != source_numbers_.end()) ++listed[found->second];
  }
  const auto fail = [&](std::uint32_t source, const char* why) {
    std::uint32_t line = UINT32_MAX;
    for (std::uint32_t i = begin_[source]; i < begin_[source + 1]; ++i)
      line = std::min(line, table_.rows()[by_source_[i]].line);
    throw InputError(inShort(table_.file()) + ":" + std::to_string(line) + ": '" + escaped(sources[source], 200) +
                     "' " + why);
  };
  // Reports the table's first line with an error.
  for (std::uint32_t s = 0; s < sources.size(); ++s) {
    if (listed[s] == 0 && table_.attributes() != nullptr) continue;  // dropped at the end, with a record
    if (listed[s] == 0) {
      const std::vector<std::string_view> there = library_.sources();
      const std::string hint = there.empty() ? "" : "; one source is '" + escaped(there.front(), 200) + "'";
      fail(s, ("is not a source of the input" + hint).c_str());
    }
    if (listed[s] > 1) fail(s, "is the source of more than one input: name their folder instead of the files");
  }
  rewind();
}

std::uint64_t PlacedCells::held_bytes() const {
  constexpr std::uint64_t kBytesOfRow = 192;  // vectors grow by halves
  return table_.rows().size() * kBytesOfRow + table_.sources().size() * 256 + table_.bytes() / 4 +
         (table_.attributes() != nullptr ? table_.attributes()->held_bytes() : 0);
}

void PlacedCells::orderRows() {
  const auto& rows = table_.rows();
  begin_.assign(table_.sources().size() + 1, 0);
  for (const PlacementTable::Row& row : rows) ++begin_[row.source + 1];
  std::partial_sum(begin_.begin(), begin_.end(), begin_.begin());
  by_source_.resize(rows.size());
  std::vector<std::uint32_t> next(begin_.begin(), begin_.end() - 1);
  for (std::uint32_t r = 0; r < rows.size(); ++r) by_source_[next[rows[r].source]++] = r;
}

void PlacedCells::rewind() {
  library_.rewind();
  met_.assign(table_.sources().size(), 0);
  turns_.clear();
  next_turn_ = 0;
  report_ = {};
  records_.clear();
  report_.rows = table_.rows().size();
}

bool PlacedCells::next(Cell& cell) {
  for (;;) {
    if (next_turn_ < turns_.size()) {
      const Turn& turn = turns_[next_turn_++];
      if (place(table_.rows()[turn.row], turn.digest, cell)) {
        cell.attributes.clear();
        if (table_.attributes() != nullptr) table_.attributes()->of(turn.row, cell.attributes);
        return true;
      }
      continue;
    }
    turns_.clear();
    next_turn_ = 0;
    morphology_.discardLarge();
    if (!library_.next(morphology_)) {
      for (std::uint32_t s = 0; s < met_.size(); ++s) {
        if (!met_[s]) skipRows(s);
        met_[s] = 1;
      }
      if (part_of_.empty()) orderRecords();
      return false;
    }
    const auto found = source_numbers_.find(morphology_.source);
    if (found == source_numbers_.end()) continue;
    const std::uint32_t source = found->second;
    met_[source] = 1;
    const Part part = partOf(source);
    const bool first = part.begin == 0 && part.end > 0;
    if (part.begin == part.end) continue;
    report_.morphologies += first ? 1 : 0;
    links_ = 0;
    for (std::uint32_t s = 0; s < morphology_.segmentRanks(); ++s) {
      const auto [child, parent] = morphology_.ends(s);
      links_ += child != parent;
    }
    bool by_soma = false;
    for (std::uint32_t i = begin_[source]; i < begin_[source + 1]; ++i)
      by_soma = by_soma || table_.rows()[by_source_[i]].by_soma;
    soma_um_ = by_soma ? somaPlace(morphology_) : Vector3d::Zero();
    if (first && soma_um_.norm() > kSomaAtOrigin_um) {
      report_.codes.add(InputCode::W_SOMA_OFFSET);
      std::array<char, 32> distance{};
      std::snprintf(distance.data(), distance.size(), " %.1f um", soma_um_.norm());
      record(table_.rows()[by_source_[begin_[source]]].line, InputCode::W_SOMA_OFFSET, Effect::kRemark,
             escaped(table_.sources()[source], 200) + distance.data());
    }
    for (std::uint32_t i = begin_[source]; i < begin_[source + 1]; ++i) {
      const PlacementTable::Row& row = table_.rows()[by_source_[i]];
      turns_.push_back({digestOf(row, table_.name(row), morphology_.digest), by_source_[i]});
    }
    // Equal digests mean equal placements with equal names.
    std::sort(turns_.begin(), turns_.end(), [](const Turn& a, const Turn& b) { return a.digest < b.digest; });
    turns_.resize(part.end);
    next_turn_ = part.begin;
  }
}

// Skips the rows of an unreadable morphology; the input's report states why.
void PlacedCells::skipRows(std::uint32_t source) {
  const Part part = partOf(source);
  for (std::uint32_t i = begin_[source] + part.begin; i < begin_[source] + part.end; ++i) {
    report_.codes.add(InputCode::W_BAD_LINE);
    record(table_.rows()[by_source_[i]].line, InputCode::W_BAD_LINE, Effect::kLineDropped,
           escaped(table_.sources()[source], 200));
  }
}

// Equal records without a token become one.
void PlacedCells::record(std::uint32_t line, InputCode code, Effect effect, std::string token) {
  if (token.empty() && !records_.empty()) {
    const InputRecord& last = records_.back().record;
    if (last.token.empty() && last.line == line && last.code == code && last.effect == effect) {
      ++records_.back().count;
      return;
    }
  }
  records_.push_back({{line, code, effect, std::move(token)}, 1});
}

void PlacedCells::orderRecords() {
  std::sort(records_.begin(), records_.end(), [](const Repeated& a, const Repeated& b) {
    return std::tie(a.record.line, a.record.code, a.record.token) <
           std::tie(b.record.line, b.record.code, b.record.token);
  });
  for (const Repeated& repeated : records_)
    for (std::uint64_t i = 0; i < repeated.count; ++i) report_.records.add(repeated.record);
  report_.records.close();
  records_ = {};
}

bool PlacedCells::place(const PlacementTable::Row& row, std::uint64_t digest, Cell& cell) {
  cell.source = morphology_.source;
  cell.digest = digest;
  cell.name = table_.name(row);
  cell.sample_ids = morphology_.sample_ids;
  cell.parents = morphology_.parents;
  cell.links = morphology_.links;
  cell.radii_um = morphology_.radii_um;
  cell.types = morphology_.types;
  cell.block_starts = morphology_.block_starts;
  cell.odd_radii = morphology_.odd_radii;
  cell.header = morphology_.header;
  const std::size_t n = morphology_.samples();
  cell.positions_um.resize(n);
  const auto turn = rotationOf(row.turned);
  const Vector3d origin_um = row.by_soma ? soma_um_ : Vector3d::Zero();
  bool inside = true;
  for (std::size_t i = 0; i < n; ++i) {
    const Vector3d p = morphology_.positions_um[i] - origin_um;
    double* placed = cell.positions_um[i].data();
    for (std::size_t axis = 0; axis < 3; ++axis) {
      placed[axis] = row.moved_um[axis] + (turn[axis][0] * p[0] + turn[axis][1] * p[1] + turn[axis][2] * p[2]);
      inside &= std::abs(placed[axis]) <= Grid::kMaxCoordinate_um;
    }
  }
  std::uint64_t links = links_;
  if (!inside) {
    dropOutside(row, cell);
    links = 0;
    for (std::uint32_t s = 0; s < cell.segmentRanks(); ++s) links += cell.ends(s)[0] != cell.ends(s)[1];
  }
  if (cell.samples() == 0) return false;
  ++report_.placed;
  report_.samples += cell.samples();
  report_.segments += links;
  return true;
}

// A link with one dropped end is cut. A link with two dropped ends is dropped with them.
void PlacedCells::dropOutside(const PlacementTable::Row& row, Cell& cell) {
  const std::string before = escaped(cell.source, 200);
  const auto report = [&](InputCode code, Effect effect, std::int64_t id) {
    report_.codes.add(code);
    record(row.line, code, effect,
           report_.codes[code] <= InputReport::kTokensKept ? before + " " + std::to_string(id) : "");
  };
  const std::size_t n = cell.samples();
  std::vector<std::uint32_t> rank(n, kNoParent);
  std::uint32_t kept = 0;
  for (std::size_t i = 0; i < n; ++i) {
    if ((cell.positions_um[i].array().abs() <= Grid::kMaxCoordinate_um).all()) {
      rank[i] = kept++;
    } else {
      report(InputCode::W_RANGE, Effect::kLineDropped, cell.sample_ids[i]);
      ++report_.dropped_samples;
    }
  }
  std::vector<std::array<std::uint32_t, 2>> edges;
  for (std::uint32_t s = 0; s < cell.segmentRanks(); ++s) {
    const auto [child, parent] = cell.ends(s);
    if (child == parent || (rank[child] == kNoParent && rank[parent] == kNoParent)) continue;
    if (rank[child] != kNoParent && rank[parent] != kNoParent) {
      edges.push_back({rank[parent], rank[child]});
    } else {
      report(InputCode::W_MISSING_PARENT, Effect::kLinkCut, cell.sample_ids[child]);
      ++report_.cut_links;
    }
  }
  const bool graph = cell.isGraph();
  std::vector<std::uint32_t> parents(kept, kNoParent);
  if (!graph)
    for (const auto& [parent, child] : edges) parents[child] = parent;

  const auto keep = [&](auto& values) {
    for (std::size_t i = 0; i < n; ++i)
      if (rank[i] != kNoParent) values[rank[i]] = values[i];
    values.resize(kept);
  };
  std::vector<std::uint32_t> blocks;
  for (const std::uint32_t start : cell.block_starts) {
    std::uint32_t first = start;
    while (first < n && rank[first] == kNoParent) ++first;
    if (first < n && rank[first] > 0 && (blocks.empty() || blocks.back() < rank[first])) blocks.push_back(rank[first]);
  }
  cell.block_starts = std::move(blocks);
  std::erase_if(cell.odd_radii, [&](const OddRadius& odd) { return rank[odd.rank] == kNoParent; });
  for (OddRadius& odd : cell.odd_radii) odd.rank = rank[odd.rank];
  keep(cell.sample_ids);
  keep(cell.positions_um);
  keep(cell.radii_um);
  keep(cell.types);
  if (graph) {
    connect(cell, std::move(edges));
  } else {
    cell.parents = std::move(parents);
  }
}

}  // namespace filiform
