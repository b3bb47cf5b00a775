// The output of `filiform nearest`: rows as text, as TSV or as one JSON array.
#pragma once

#include "index/measure/segment_looks.h"
#include "index/query/nearest.h"
#include "index/set/tile_set.h"
#include "tools/words/sample_ids.h"

#include <cstddef>
#include <iosfwd>
#include <optional>
#include <string>
#include <string_view>

namespace filiform::tools {

// Makes the text of rows. Thread rule: internally synchronised.
class NearestRowText {
 public:
  // The set and `nearest`, which searches it, must outlive this object.
  NearestRowText(const TileSet& set, const Nearest& nearest, bool json);

  // Reads what append() needs for these results: see SampleIds::readAhead(). Returns their looks, in this order. Throws
  // as SegmentLooks::of().
  template <typename Results>
  std::vector<SegmentLook> readAhead(const Results& results) {
    sample_ids_.readAhead(results);
    return looks_.of(results);
  }
  // Appends a row for the point with this number, whose search took `tiles`; `along`: of a ray. Throws as
  // SampleIds::cell() does.
  void append(std::string& text, std::size_t query, const NearestResult& result, const SegmentLook& look,
              std::uint32_t tiles, std::optional<double> along = {});

 private:
  const TileSet& set_;
  const bool json_;
  SampleIds sample_ids_;
  SegmentLooks looks_;
};

// Writes texts of rows, with what stands before, between and after them. Thread rule: thread-compatible.
class NearestRowWriter {
 public:
  // `along`: rows of a ray. Writes nothing before the first write() or end(), so that a refused query prints no header.
  NearestRowWriter(std::ostream& out, bool json, bool along) : out_(out), json_(json), along_(along) {}

  // Any number of rows, also none.
  void write(std::string_view rows);
  void end();

 private:
  void begin();

  std::ostream& out_;
  const bool json_, along_;
  bool begun_ = false;
  const char* separator_ = "\n";
};

}  // namespace filiform::tools
