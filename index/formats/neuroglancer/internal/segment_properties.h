// The segment properties of Neuroglancer skeletons: for each object a name and attributes. They are the file `info` in
// the folder that `segment_properties` of the skeletons' info names.
//
//   property                 becomes
//   label                    the name of the cell, unless it is empty
//   description, string      an attribute of text. With the description "integer" or "real", as skeletonProperties()
//                            writes them, a number
//   number                   an attribute: an integer, or for float32 a real
//   tags                     a tag NAME=TEXT is the attribute NAME; the others together are the attribute named as the
//                            property, with blanks between them. A description of a tag that differs from the tag in
//                            blanks only is read in its place
//
// A property that skeletonProperties() computed (kComputed) is left out: a set has these numbers itself. Thread rule:
// immutable.
#pragma once

#include "index/cell/cell.h"

#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

namespace filiform {

class SegmentProperties {
 public:
  static constexpr std::uint64_t kMaxBytes = std::uint64_t{1} << 28;
  static constexpr std::string_view kComputed = "counted by filiform";  // description of such a property

  // Reads the text of `info`; without `inline` it describes no object. Throws InputError naming `file` if an id is no
  // decimal number from 0 to 2^64-1, if a property has no id, another number of values than there are ids or a value
  // of another kind, or if two properties have the same id. O(length).
  SegmentProperties(std::string_view json, const std::string& file);

  const std::vector<std::uint64_t>& ids() const { return ids_; }  // ascending, each once
  // Properties of a type that is not known, and labels after the first; they are left out.
  const std::vector<std::string>& leftOut() const { return left_out_; }
  std::uint64_t held_bytes() const { return held_bytes_; }

  // Adds the attributes of object `id` to a cell, and gives it its name. The attribute `id`, the object's id, comes
  // first, unless a property has this id. O(properties + log objects).
  void apply(std::uint64_t id, Cell& cell) const;

 private:
  struct Column {
    std::string name;
    std::vector<AttributeValue> values;  // by row
  };
  struct Reader;

  std::vector<std::uint64_t> ids_;
  std::vector<std::uint32_t> rows_;  // of the columns, by position in ids_
  std::vector<std::string> labels_;  // by row; empty: none
  std::vector<Column> columns_;
  std::vector<std::string> left_out_;
  std::uint64_t held_bytes_ = 0;
  bool ids_fit_ = true;  // in 64-bit signed integers
};

}  // namespace filiform
