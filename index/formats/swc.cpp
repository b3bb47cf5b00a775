#include "index/formats/swc.h"

#include "index/errors.h"
#include "index/file/internal/digest.h"
#include "index/file/internal/file_parts.h"
#include "index/formats/internal/catmaid_columns.h"
#include "index/formats/swc/internal/line_splitter.h"
#include "index/formats/swc/internal/plain_numbers.h"
#include "index/formats/swc/internal/swc_fields.h"
#include "index/formats/swc/internal/swc_graph.h"
#include "index/formats/swc/internal/swc_header.h"
#include "index/formats/swc/internal/text_sniff.h"
#include "index/text.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <utility>
#include <vector>

namespace filiform {
namespace {

using internal::IntegerKind;
using internal::RealKind;
using internal::SwcSample;

constexpr std::size_t kSniffBytes = 4096, kMostSeparatorText = 200;
constexpr std::string_view kUtf8Mark = "\xEF\xBB\xBF";

void setRadius(SwcSample& sample, double radius_um, bool may_be_odd) {
  sample.radius_um = storedRadius(radius_um);
  if (may_be_odd && isOddRadius(radius_um)) sample.odd_radius_um = radius_um;
}

}  // namespace

struct SwcReader::State {
  explicit State(const SwcOptions& swc_options) : options(swc_options), graph(book), lines(*this, kMaxDataLine) {
    options.check();
  }
  State(const State&) = delete;
  State& operator=(const State&) = delete;

  // The functions that LineSplitter calls.
  void dataLine(std::string_view text, bool has_nul, std::uint64_t line);
  void longLine(std::string_view start, std::uint64_t line);
  void comment(std::string_view start, bool has_nul, std::uint64_t line);
  void loneCarriageReturn(std::uint64_t line);

  void keepComment(std::string_view line, bool applied);
  bool plainLine(std::string_view text, std::uint64_t line);
  void anyLine(std::string_view text, std::uint64_t line);
  bool readPosition(const internal::SwcFields& fields, std::uint64_t line, std::int64_t id, SwcSample& sample);
  void readRest(const internal::SwcFields& fields, SwcSample& sample);
  bool place(Vector3d& position) const;
  void drop(InputCode code, std::uint64_t line, std::string_view token, bool unreadable);

  void sniff(bool at_end);
  void refuseWhole(InputCode code, std::uint64_t line = 0, std::string_view token = {});
  void feed(std::string_view bytes);
  InputReport finish(std::string_view file, Cell& cell);
  void judge(InputReport& report);
  void reset();

  SwcOptions options;
  internal::RunningDigest digest;
  internal::RecordBook book;
  internal::SwcGraph graph;
  internal::LineSplitter<State> lines;
  std::string head;  // held until it suffices to recognise text
  bool sniffed = false;
  bool refused = false;  // the whole input; all that was read is discarded
  bool seen_carriage_return = false;
  std::uint64_t separator_line = 0;  // the first with separators; remarked if any sample is read
  std::string separator_text;
  std::uint64_t candidates = 0, unreadable_lines = 0, later_comments = 0;
  SwcHeader header;
  std::string header_text;
  std::uint64_t header_lines_left_out = 0;
  bool header_in_um = false;     // a line states micrometres; then no other line means another unit
  std::uint64_t units_line = 0;  // the first line that names another unit
  std::string units_text;
};

// A line that states a unit, a scale or an offset is no longer true of an exported cell if the reader applied it. It is
// then kept in a form that readHeaderLine() does not understand.
void SwcReader::State::keepComment(std::string_view line, bool applied) {
  constexpr std::string_view kApplied = "# (applied) ";
  if (line.size() + kApplied.size() + header_text.size() > Cell::kMostHeader) {
    ++header_lines_left_out;
    return;
  }
  if (!header_text.empty()) header_text += '\n';
  if (applied) {
    header_text += kApplied;
    line.remove_prefix(std::min(line.find_first_not_of("# \t"), line.size()));
  }
  header_text += line;
}

void SwcReader::State::comment(std::string_view start, bool has_nul, std::uint64_t line) {
  if (refused) return;
  later_comments += candidates > 0;
  if (has_nul) book.remark(InputCode::W_NUL, line);
  const internal::HeaderLine said = internal::readHeaderLine(start);
  if (candidates == 0)
    keepComment(start, (said.scale || !said.foreign_unit.empty()) ? !options.isMicrometres()
                                                                  : said.offset && options.apply_offset);
  if (said.scale) {
    header.scale = said.scale;
    if (*said.scale != Vector3d::Ones()) book.remark(InputCode::W_HEADER_SCALE, line, start);
  }
  if (said.offset) {
    header.offset = said.offset;
    if (*said.offset != Vector3d::Zero() && !options.apply_offset) book.remark(InputCode::W_HEADER_SCALE, line, start);
  }
  if (said.in_um && candidates == 0) header_in_um = true;
  if (!said.foreign_unit.empty() && header.units.empty()) {
    header.units = escaped(said.foreign_unit);
    units_line = line;
    units_text = start;
  }
}

void SwcReader::State::loneCarriageReturn(std::uint64_t line) {
  if (refused || seen_carriage_return) return;
  seen_carriage_return = true;
  book.remark(InputCode::W_CR, line);
}

void SwcReader::State::drop(InputCode code, std::uint64_t line, std::string_view token, bool unreadable) {
  book.dropLine(code, line, token);
  unreadable_lines += unreadable;
}

void SwcReader::State::longLine(std::string_view start, std::uint64_t line) {
  if (refused) return;
  ++candidates;
  drop(InputCode::W_LONG_LINE, line, start, true);
}

void SwcReader::State::dataLine(std::string_view text, bool has_nul, std::uint64_t line) {
  if (refused) return;
  ++candidates;
  if (has_nul) {
    drop(InputCode::W_NUL, line, text, true);
  } else if (!plainLine(text, line)) {
    anyLine(text, line);
  }
}

namespace {

const char* skipBlanks(const char* at, const char* end) {
  while (at < end && internal::isBlank(*at)) ++at;
  return at;
}

}  // namespace

// The fast path: handles the line only if all of it is plain; otherwise changes nothing.
bool SwcReader::State::plainLine(std::string_view text, std::uint64_t line) {
  const char* at = text.data();
  const char* const end = at + text.size();
  SwcSample sample;
  std::int64_t type = 0;
  at = skipBlanks(at, end);
  if (!internal::plainInteger(at, std::min(end, at + 19), sample.id, 18) || at == end || !internal::isBlank(*at))
    return false;
  at = skipBlanks(at, end);
  if (!internal::plainInteger(at, std::min(end, at + 6), type, 5) || at == end || !internal::isBlank(*at) ||
      type > 65535)
    return false;
  Vector3d position;
  for (int axis = 0; axis < 3; ++axis) {
    at = skipBlanks(at, end);
    if (!internal::plainReal(at, end, position[axis])) return false;
    if (std::abs(position[axis]) > Grid::kMaxInput_um) return false;
  }
  double radius = 0;
  at = skipBlanks(at, end);
  const char* const radius_text = at;
  if (!internal::plainReal(at, end, radius) || radius <= 0) return false;
  const bool may_be_odd =
      options.radius_um() != 1 || mayBeOdd({radius_text, static_cast<std::size_t>(at - radius_text)});
  at = skipBlanks(at, end);
  const bool negative = at < end && *at == '-';
  at += negative;
  if (!internal::plainInteger(at, std::min(end, at + 19), sample.parent, 18)) return false;
  if (negative) {
    if (sample.parent != 1) return false;
    sample.parent = -1;
  }
  if (skipBlanks(at, end) != end) return false;

  setRadius(sample, radius * options.radius_um(), may_be_odd);
  if (!std::isfinite(sample.radius_um) || !place(position)) return false;
  sample.position_um = position;
  sample.type = static_cast<std::uint16_t>(type);
  sample.parent_kind = negative ? SwcSample::Parent::kRoot : SwcSample::Parent::kId;
  graph.add(sample, line);
  return true;
}

// Converts the file's unit to um. Returns false if the result is outside the grid's range.
bool SwcReader::State::place(Vector3d& position) const {
  if (options.apply_offset && header.offset) position += *header.offset;
  position = options.toMicrometres(position);
  return (position.array().abs() <= Grid::kMaxCoordinate_um).all();
}

void SwcReader::State::anyLine(std::string_view text, std::uint64_t line) {
  if (candidates == 1 && internal::CatmaidColumns::of(text).isCatmaid()) {
    refuseWhole(InputCode::E_FORMAT, line, "CATMAID's columns; name the file .csv");
    return;
  }
  const internal::SwcFields fields = internal::splitFields(text);
  if (fields.decimal_comma) {
    refuseWhole(InputCode::E_DECIMAL_COMMA, line, text);
    return;
  }
  if (fields.count < internal::kSwcColumns) {
    drop(InputCode::W_SHORT_LINE, line, text, true);
    return;
  }
  if (fields.separators && separator_line == 0) {
    separator_line = line;
    separator_text = text.substr(0, kMostSeparatorText);
  }
  SwcSample sample;
  const IntegerKind id_kind = internal::readInteger(fields.columns[0], sample.id);
  const bool id_valid = (id_kind == IntegerKind::kInteger || id_kind == IntegerKind::kIntegral) && sample.id >= 0;
  if (id_kind == IntegerKind::kText) {
    drop(InputCode::W_BAD_LINE, line, fields.columns[0], true);
    return;
  }
  if (!readPosition(fields, line, id_valid ? sample.id : -1, sample)) return;
  readRest(fields, sample);
  if (!graph.add(sample, line)) return;

  if (id_kind == IntegerKind::kIntegral) book.remark(InputCode::W_FLOAT_ID, line, fields.columns[0]);
  if (fields.extra_columns) book.remark(InputCode::W_EXTRA_COLUMNS, line);
  std::int64_t type = 0;
  const IntegerKind type_kind = internal::readInteger(fields.columns[1], type);
  if ((type_kind != IntegerKind::kInteger && type_kind != IntegerKind::kIntegral) || type != sample.type) {
    book.remark(InputCode::W_BAD_TYPE, line, fields.columns[1]);
  }
  if (std::isnan(sample.radius_um)) {
    book.remark(InputCode::W_BAD_RADIUS, line, fields.columns[5]);
  } else if (sample.radius_um == 0) {
    book.remark(InputCode::W_ZERO_RADIUS, line);
  }
}

// Drops the line, with one record, unless the id (-1 if invalid) and all coordinates are valid. The record names
// non-numbers first, then the id, then the coordinates.
bool SwcReader::State::readPosition(const internal::SwcFields& fields, std::uint64_t line, std::int64_t id,
                                    SwcSample& sample) {
  Vector3d position;
  std::array<RealKind, 3> kinds{};
  for (std::size_t axis = 0; axis < 3; ++axis) {
    kinds[axis] = internal::readReal(fields.columns[axis + 2], position[static_cast<Eigen::Index>(axis)]);
    if (kinds[axis] != RealKind::kText) continue;
    if (id >= 0) graph.noteDropped(id);
    drop(InputCode::W_BAD_LINE, line, fields.columns[axis + 2], true);
    return false;
  }
  if (id < 0) {
    drop(InputCode::W_BAD_ID, line, fields.columns[0], false);
    return false;
  }
  for (std::size_t axis = 0; axis < 3; ++axis) {
    if (kinds[axis] != RealKind::kNonfinite) continue;
    graph.noteDropped(id);
    drop(InputCode::W_NONFINITE, line, fields.columns[axis + 2], false);
    return false;
  }
  std::size_t far_axis = 0;
  while (far_axis < 3 && std::abs(position[static_cast<Eigen::Index>(far_axis)]) <= Grid::kMaxInput_um) ++far_axis;
  if (far_axis < 3 || !place(position)) {
    graph.noteDropped(id);
    drop(InputCode::W_RANGE, line, far_axis < 3 ? fields.columns[far_axis + 2] : std::string_view(), false);
    return false;
  }
  sample.position_um = position;
  return true;
}

// Reads type, radius and parent. A bad value loses only that field.
void SwcReader::State::readRest(const internal::SwcFields& fields, SwcSample& sample) {
  std::int64_t type = 0;
  const IntegerKind type_kind = internal::readInteger(fields.columns[1], type);
  const bool type_valid = type_kind == IntegerKind::kInteger || type_kind == IntegerKind::kIntegral;
  sample.type = type_valid && type >= 0 && type <= 65535 ? static_cast<std::uint16_t>(type) : std::uint16_t{0};

  double radius = 0;
  sample.radius_um = kUnknownRadius;
  if (internal::readReal(fields.columns[5], radius) == RealKind::kFinite && radius >= 0) {
    setRadius(sample, radius * options.radius_um(), true);
    if (!std::isfinite(sample.radius_um)) sample.radius_um = kUnknownRadius;
  }

  sample.parent_token = fields.columns[6];
  switch (internal::readInteger(fields.columns[6], sample.parent)) {
    case IntegerKind::kInteger:
    case IntegerKind::kIntegral:
      sample.parent_kind = sample.parent == -1 ? SwcSample::Parent::kRoot : SwcSample::Parent::kId;
      break;
    case IntegerKind::kBelow:
      sample.parent_kind = SwcSample::Parent::kId;
      sample.parent = std::numeric_limits<std::int64_t>::min();
      break;
    case IntegerKind::kInvalid:
    case IntegerKind::kText:
      sample.parent_kind = SwcSample::Parent::kUnreadable;
      break;
  }
}

void SwcReader::State::refuseWhole(InputCode code, std::uint64_t line, std::string_view token) {
  refused = true;
  book.clear();
  book.refuse(code, line, token);
  graph.clear();
  header = {};
  header_text = {};
  candidates = unreadable_lines = later_comments = 0;
}

void SwcReader::State::sniff(bool at_end) {
  if (!at_end && head.size() < kSniffBytes) return;
  sniffed = true;
  std::string_view text = head;
  if (internal::hasBinaryMagic(text)) {
    refuseWhole(InputCode::E_NOT_TEXT);
  } else if (internal::isWideText(text.substr(0, kSniffBytes))) {
    refuseWhole(InputCode::E_ENCODING);
  } else {
    if (text.starts_with(kUtf8Mark)) {
      text.remove_prefix(kUtf8Mark.size());
      book.remark(InputCode::W_BOM, 1);
    }
    lines.feed(text);
  }
  head.clear();
}

void SwcReader::State::feed(std::string_view bytes) {
  digest.add(bytes);
  if (!sniffed) {
    const std::string_view first = bytes.substr(0, kSniffBytes - head.size());
    head += first;
    bytes.remove_prefix(first.size());
    sniff(false);
  }
  if (!refused) lines.feed(bytes);
}

void SwcReader::State::judge(InputReport& report) {
  if (refused) return;
  if (report.samples == 0) {
    book.refuse(InputCode::E_NO_SAMPLES);
  } else if (isMostlyBad(candidates, unreadable_lines, report.samples)) {
    book.refuse(InputCode::E_MOSTLY_BAD);
  }
}

InputReport SwcReader::State::finish(std::string_view file, Cell& cell) {
  if (!sniffed) sniff(true);
  lines.finish();
  if (!refused && lines.nuls() * 5 > lines.bytes()) refuseWhole(InputCode::E_NOT_TEXT);

  if (header_in_um) header.units.clear();
  if (!refused && !header.units.empty() && options.isMicrometres())
    book.remark(InputCode::W_UNITS, units_line, units_text);

  InputReport report;
  graph.finish(cell, report);
  if (!refused && separator_line > 0 && report.samples > 0)
    book.remark(InputCode::W_SEPARATOR, separator_line, separator_text);
  judge(report);
  report.candidate_lines = candidates;
  report.later_comments = later_comments;
  report.header = std::move(header);
  book.moveTo(report);
  report.dropped_lines = report.records.count(Effect::kLineDropped);
  const std::uint64_t cut = report.records.count(Effect::kLinkCut);
  if (candidates != report.samples + report.dropped_lines || report.links_given != report.segments + cut ||
      cut != report.links_cut) {
    throw ConservationError(inShort(file) + ": samples or links were lost without a record (" +
                            std::to_string(candidates) + " lines, " + std::to_string(report.samples) + " kept, " +
                            std::to_string(report.dropped_lines) + " dropped; " + std::to_string(report.links_given) +
                            " links, " + std::to_string(report.segments) + " kept, " + std::to_string(cut) +
                            " cut); please report this with the file");
  }
  const bool refuse = report.codes.anyRefusal() || (options.strict && report.codes.anyWarning());
  report.severity = refuse ? Severity::kRefuse : report.codes.anyWarning() ? Severity::kWarn : Severity::kAccept;
  if (refuse) {
    report.samples = report.segments = report.isolated = report.roots = 0;
    cell.clearSamples();
  }
  cell.links.clear();
  cell.name.clear();
  if (header_lines_left_out > 0)
    header_text += "\n# (" + std::to_string(header_lines_left_out) + std::string(Cell::kHeaderCut);
  cell.header = refuse ? std::string() : std::exchange(header_text, {});
  cell.digest = digest.value();
  reset();
  return report;
}

void SwcReader::State::reset() {
  digest.reset();
  book.clear();
  graph.clear();
  lines = internal::LineSplitter<State>(*this, kMaxDataLine);
  head.clear();
  sniffed = refused = seen_carriage_return = false;
  candidates = unreadable_lines = later_comments = header_lines_left_out = units_line = separator_line = 0;
  header_in_um = false;
  units_text.clear();
  header = {};
  header_text.clear();
}

void SwcOptions::check() const {
  const auto good = [](double unit) { return std::isfinite(unit) && unit > 0; };
  if (!good(unit_um) || (voxel_um && !(good(voxel_um->x()) && good(voxel_um->y()) && good(voxel_um->z()))))
    throw UsageError("a unit must be a finite number of um above 0");
}

SwcReader::SwcReader(const SwcOptions& options) : state_(std::make_unique<State>(options)) {}
SwcReader::~SwcReader() = default;
SwcReader::SwcReader(SwcReader&&) noexcept = default;
SwcReader& SwcReader::operator=(SwcReader&&) noexcept = default;

void SwcReader::feed(std::string_view bytes) { state_->feed(bytes); }
InputReport SwcReader::finish(std::string_view file, Cell& cell) { return state_->finish(file, cell); }
std::uint64_t SwcReader::samples() const { return state_->graph.samples(); }
std::uint64_t SwcReader::held_bytes(double times) const { return state_->graph.bytes(times); }
void SwcReader::discard() { state_->reset(); }

InputReport readSwc(std::string_view text, std::string_view file, const SwcOptions& options, Cell& cell) {
  SwcReader reader(options);
  reader.feed(text);
  return reader.finish(file, cell);
}

InputReport readSwcFile(const std::string& path, SwcReader& reader, Cell& cell,
                        const std::function<void(std::uint64_t bytes)>& progress) {
  internal::FileParts file(path);
  reader.discard();
  std::vector<char> block(std::size_t{1} << 16);
  while (const std::size_t n = file.next(block)) {
    reader.feed({block.data(), n});
    if (progress) progress(n);
  }
  return reader.finish(path, cell);
}

}  // namespace filiform
