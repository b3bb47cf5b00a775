#include "tools/commands/shared/nearest_rows.h"

#include "index/measure/cell_measures.h"
#include "index/text.h"
#include "tools/words/answer.h"
#include "tools/words/numbers.h"
#include "tools/words/segment_row.h"

#include <cmath>
#include <ostream>
#include <utility>

namespace filiform::tools {

namespace {

constexpr std::uint64_t kSampleIdBytes = std::uint64_t{64} << 20, kLookBytes = std::uint64_t{32} << 20;

}  // namespace

NearestRowText::NearestRowText(const TileSet& set, const Nearest& nearest, bool json)
    : set_(set), json_(json), sample_ids_(set, kSampleIdBytes), looks_(nearest.tiles(), kLookBytes) {}

void NearestRowText::append(std::string& text, std::size_t query, const NearestResult& r, const SegmentLook& look,
                            std::uint32_t tiles, std::optional<double> along) {
  const std::string& cell = set_.cell(r.segment.cell).name;
  const std::int64_t sample = sample_ids_.cell(r.segment.cell)->of(r.segment.segment);
  if (json_) {
    if (!text.empty()) text += ",\n";
    text += jsonText(segmentRowJson({query, &r, &cell, sample, along, look, tiles}));
    return;
  }
  text += std::to_string(query) + '\t' + std::to_string(r.rank) + '\t' + formatNumber(r.distance_um);
  for (int axis = 0; axis < 3; ++axis) text += '\t' + formatNumber(r.p_W[axis]);
  text += '\t' + escaped(cell) + '\t' + std::to_string(r.segment.segment) + '\t' + std::to_string(sample) +
          (r.exact ? "\ttrue\t" : "\tfalse\t") + std::to_string(tiles);
  if (along) text += '\t' + formatNumber(*along);
  text += '\t' + (look.type ? neuriteTypeName(*look.type) : "-") + '\t' +
          (std::isnan(look.radius_um) ? "-" : formatNumber(look.radius_um)) + '\t' + formatNumber(r.t) + '\n';
}

void NearestRowWriter::write(std::string_view rows) {
  begin();
  if (rows.empty()) return;
  if (json_) out_ << std::exchange(separator_, ",\n");
  out_ << rows;
}

void NearestRowWriter::end() {
  begin();
  if (json_) out_ << "\n]\n";
}

void NearestRowWriter::begin() {
  if (std::exchange(begun_, true)) return;
  if (json_)
    out_ << '[';
  else
    out_ << "query\trank\tdistance\tx\ty\tz\tcell\tsegment\tsample\texact\ttiles_read" << (along_ ? "\talong" : "")
         << "\ttype\tradius\tt\n";
}

}  // namespace filiform::tools
