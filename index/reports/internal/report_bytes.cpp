#include "index/reports/internal/report_bytes.h"

namespace filiform::internal {
namespace {

void writeOptionalVector(ByteWriter& out, const std::optional<Vector3d>& v) {
  out.u8(v ? 1 : 0);
  if (v)
    for (int axis = 0; axis < 3; ++axis) out.f64((*v)[axis]);
}

std::optional<Vector3d> readOptionalVector(ByteReader& in) {
  if (in.u8() == 0) return std::nullopt;
  Vector3d v;
  for (int axis = 0; axis < 3; ++axis) v[axis] = in.f64();
  return v;
}

}  // namespace

void encodeRecord(const InputRecord& record, ByteWriter& out) {
  out.varint(record.line);
  out.u8(static_cast<std::uint8_t>(record.code));
  out.u8(static_cast<std::uint8_t>(record.effect));
  out.sizedText(record.token);
}

InputRecord decodeRecord(ByteReader& in) {
  InputRecord record;
  record.line = in.varint();
  record.code = static_cast<InputCode>(in.u8());
  record.effect = static_cast<Effect>(in.u8());
  record.token = in.sizedText();
  return record;
}

void encodeCodes(const CodeCounts& codes, ByteWriter& out) {
  out.varint(codes.all().size());
  for (const auto& [code, count] : codes.all()) {
    out.u8(static_cast<std::uint8_t>(code));
    out.varint(count);
  }
}

CodeCounts decodeCodes(ByteReader& in) {
  CodeCounts codes;
  for (std::uint64_t n = in.varint(); n > 0; --n) {
    const auto code = static_cast<InputCode>(in.u8());
    codes.add(code, in.varint());
  }
  return codes;
}

void encodeReport(const InputReport& report, ByteWriter& out) {
  out.u8(static_cast<std::uint8_t>(report.severity));
  for (const std::uint64_t count :
       {report.cells, report.samples, report.segments, report.isolated, report.roots, report.candidate_lines,
        report.dropped_lines, report.merged_points, report.links_given, report.links_cut, report.later_comments})
    out.varint(count);
  encodeCodes(report.codes, out);
  out.varint(report.records.size());
  for (const InputRecord& record : report.records) encodeRecord(record, out);
  writeOptionalVector(out, report.header.scale);
  writeOptionalVector(out, report.header.offset);
  out.sizedText(report.header.units);
}

InputReport decodeReport(ByteReader& in) {
  InputReport report;
  report.severity = static_cast<Severity>(in.u8());
  for (std::uint64_t* const count :
       {&report.cells, &report.samples, &report.segments, &report.isolated, &report.roots, &report.candidate_lines,
        &report.dropped_lines, &report.merged_points, &report.links_given, &report.links_cut, &report.later_comments})
    *count = in.varint();
  report.codes = decodeCodes(in);
  for (std::uint64_t n = in.varint(); n > 0; --n) report.records.add(decodeRecord(in));
  report.records.close();
  report.header.scale = readOptionalVector(in);
  report.header.offset = readOptionalVector(in);
  report.header.units = in.sizedText();
  return report;
}

}  // namespace filiform::internal
