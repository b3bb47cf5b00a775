// The bytes in which processes that read together pass on their reports. Thread rule: pure functions.
#pragma once

#include "index/file/internal/bytes.h"
#include "index/reports/input_report.h"

namespace filiform::internal {

void encodeRecord(const InputRecord& record, ByteWriter& out);
InputRecord decodeRecord(ByteReader& in);
void encodeReport(const InputReport& report, ByteWriter& out);
InputReport decodeReport(ByteReader& in);
void encodeCodes(const CodeCounts& codes, ByteWriter& out);
CodeCounts decodeCodes(ByteReader& in);

}  // namespace filiform::internal
