// SegmentRows: the segments that a query found, as the body of an answer. Thread rule: thread-compatible.
#pragma once

#include "tools/serve/sets/served_set.h"
#include "tools/words/answer.h"
#include "tools/words/segment_row.h"

#include <cstdint>
#include <memory>
#include <optional>
#include <string>

namespace filiform::tools {

class SegmentRows {
 public:
  // `npy`: an array of records; else JSON. `along`: the rows of a ray. `served` must outlive this object.
  SegmentRows(const ServedSet& served, bool npy, bool along);

  // Adds a row. Without effect, except that the answer becomes truncated, if limits::kAnswerBytes are reached. Throws
  // CorruptSet, IoError, AnswerTimeout.
  void add(std::size_t query, const NearestResult& result, const SegmentLook& look, std::optional<double> along = {});
  std::size_t size() const { return rows_; }
  // Results were left out.
  void truncate() { truncated_ = true; }
  // The answer comes in parts, and names where the next one begins; nullopt: this is the last one.
  void continueAt(const std::optional<std::string>& cursor) {
    cursor_ = cursor;
    in_parts_ = true;
    truncated_ = truncated_ || cursor;
  }
  // The answer, once: {"truncated": ..., "rows": [...]}, or the array and the header Filiform-Truncated. In parts, also
  // the member `cursor` and the header Filiform-Cursor.
  Answer take();

 private:
  const ServedSet& served_;
  const bool npy_, along_;
  bool truncated_ = false, in_parts_ = false;
  std::optional<std::string> cursor_{};
  std::size_t rows_ = 0;
  std::string body_;
  std::uint32_t cell_ = 0;                             // of the last row
  std::shared_ptr<const SampleIds::OfCell> ids_ = {};  // of that cell
};

}  // namespace filiform::tools
