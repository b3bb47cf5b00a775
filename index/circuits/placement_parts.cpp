// Parts of a table of placements, for processes that place cells together.
#include "index/circuits/placements.h"
#include "index/reports/internal/report_bytes.h"

#include <algorithm>
#include <utility>

namespace filiform {

using internal::ByteReader;
using internal::ByteWriter;

PlacedCells::Part PlacedCells::partOf(std::uint32_t source) const {
  const std::uint32_t rows = begin_[source + 1] - begin_[source];
  if (part_of_.empty()) return {0, rows};
  return {std::min(part_of_[source].begin, rows), std::min(part_of_[source].end, rows)};
}

// To read an input takes its bytes, and so does each placement of it.
PlacedCells::Sources PlacedCells::keepPart(unsigned part, unsigned count) {
  const std::vector<std::string_view> sources = library_.sources();
  const std::vector<std::uint64_t> sizes = library_.sizes();
  const auto rowsOf = [this](std::string_view source) {
    const auto found = source_numbers_.find(source);
    return found == source_numbers_.end() ? 0u : begin_[found->second + 1] - begin_[found->second];
  };
  double all = 0;
  for (std::size_t i = 0; i < sources.size(); ++i)
    all += static_cast<double>(sizes[i] + 1) * (1.0 + rowsOf(sources[i]));
  const auto boundary = [&](unsigned p) { return p == count ? all + 1 : all / count * p; };
  const double from = boundary(part), to = boundary(part + 1);

  Sources range;
  if (part == 0) range.begin.emplace();
  part_of_.assign(table_.sources().size(), {0, 0});
  std::size_t first = sources.size(), end = 0;
  double at = 0;
  for (std::size_t i = 0; i < sources.size(); ++i) {
    const double size = static_cast<double>(sizes[i] + 1);
    const std::uint32_t rows = rowsOf(sources[i]);
    // The number of rows that lie before a boundary; row j begins at `at` + size (1 + j).
    const auto before = [&](double place) {
      std::uint32_t j = static_cast<std::uint32_t>(std::clamp((place - at) / size - 1, 0.0, static_cast<double>(rows)));
      while (j > 0 && at + size * (1.0 + (j - 1)) >= place) --j;
      while (j < rows && at + size * (1.0 + j) < place) ++j;
      return j;
    };
    const Part rows_here{before(from), before(to)};
    if (!range.begin && rows_here.begin < rows) range.begin = sources[i];
    if (!range.end && part + 1 < count && rows_here.end < rows) range.end = sources[i];
    if (rows > 0) part_of_[source_numbers_.find(sources[i])->second] = rows_here;
    if (rows_here.begin < rows_here.end || (at >= from && at < to)) {
      first = std::min(first, i);
      end = i + 1;
    }
    at += size * (1.0 + rows);
  }
  // Rows without an input are reported by the first part.
  std::vector<std::uint8_t> listed(table_.sources().size(), 0);
  for (const std::string_view source : sources)
    if (const auto found = source_numbers_.find(source); found != source_numbers_.end()) listed[found->second] = 1;
  for (std::size_t s = 0; s < listed.size(); ++s)
    if (listed[s] == 0 && part == 0) part_of_[s] = {};
  // keepOnly() rounds down to where the source changes.
  while (end > 0 && end < sources.size() && sources[end] == sources[end - 1]) ++end;
  library_.keepOnly(std::min(first, end), end);
  rewind();
  return range;
}

std::vector<std::uint8_t> PlacedCells::encodeReport() const {
  ByteWriter out;
  for (const std::uint64_t value : {report_.placed, report_.morphologies, report_.samples, report_.segments,
                                    report_.dropped_samples, report_.cut_links})
    out.u64(value);
  internal::encodeCodes(report_.codes, out);
  out.varint(records_.size());
  for (const Repeated& repeated : records_) {
    internal::encodeRecord(repeated.record, out);
    out.varint(repeated.count);
  }
  return out.take();
}

void PlacedCells::takeReports(const std::vector<std::vector<std::uint8_t>>& parts) {
  report_ = {};
  report_.rows = table_.rows().size();
  records_.clear();
  std::uint64_t ranges = 0, links = 0;
  for (const std::vector<std::uint8_t>& bytes : parts) {
    ByteReader in(bytes);
    for (std::uint64_t* const value : {&report_.placed, &report_.morphologies, &report_.samples, &report_.segments,
                                       &report_.dropped_samples, &report_.cut_links})
      *value += in.u64();
    report_.codes.add(internal::decodeCodes(in));
    for (std::uint64_t n = in.varint(); n > 0; --n) {
      Repeated repeated{internal::decodeRecord(in), 0};
      repeated.count = in.varint();
      // Only the first records keep their token, as in one process.
      const bool range = repeated.record.code == InputCode::W_RANGE;
      if (range || repeated.record.code == InputCode::W_MISSING_PARENT) {
        std::uint64_t& before = range ? ranges : links;
        if (before >= InputReport::kTokensKept) repeated.record.token.clear();
        before += repeated.count;
      }
      records_.push_back(std::move(repeated));
    }
  }
  orderRecords();
}

}  // namespace filiform
