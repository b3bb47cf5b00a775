#include "tools/serve/routes/segment_rows.h"

#include "tools/serve/sets/limits.h"
#include "tools/words/npy.h"

#include <utility>

namespace filiform::tools {

SegmentRows::SegmentRows(const ServedSet& served, bool npy, bool along) : served_(served), npy_(npy), along_(along) {}

void SegmentRows::add(std::size_t query, const NearestResult& result, const SegmentLook& look,
                      std::optional<double> along) {
  constexpr std::size_t kRowBytes = 4096;  // room for one more row and the end; names of files are shorter
  if (rows_ == limits::kRows || body_.size() + kRowBytes > limits::kAnswerBytes) {
    truncated_ = true;
    return;
  }
  if (ids_ == nullptr || cell_ != result.segment.cell) {
    cell_ = result.segment.cell;
    ids_ = served_.sampleIds().cell(cell_);
  }
  const SegmentRow row{
      query, &result, npy_ ? nullptr : &served_.set().cell(cell_).name, ids_->of(result.segment.segment), along, look};
  if (npy_)
    appendSegmentRecord(body_, row);
  else
    (body_ += rows_ == 0 ? "\n" : ",\n") += jsonText(segmentRowJson(row));
  ++rows_;
}

Answer SegmentRows::take() {
  const char* const truncated = truncated_ ? "true" : "false";
  Answer answer{.type = npy_ ? kNpyType : kJsonType};
  if (npy_)
    answer.body = npyHeader(segmentRecordType(along_), rows_) + body_;
  else
    answer.body = std::string("{\"truncated\":") + truncated +
                  (in_parts_ ? ",\"cursor\":" + (cursor_ ? jsonText(*cursor_) : "null") : "") + ",\"rows\":[" + body_ +
                  "\n]}\n";
  answer.headers.emplace_back("Filiform-Truncated", truncated);
  if (cursor_) answer.headers.emplace_back("Filiform-Cursor", *cursor_);
  body_ = {};
  return answer;
}

}  // namespace filiform::tools
