// The bytes of the section `attributes`. FORMAT.md specifies them. Decoders throw Damage and never read past their
// input.
#pragma once

#include "index/cell/attribute.h"
#include "index/file/internal/bytes.h"

#include <cstdint>
#include <functional>
#include <map>
#include <string>
#include <unordered_map>
#include <vector>

namespace filiform::internal {

inline constexpr const char* kAttributesSection = "attributes";
inline constexpr std::uint32_t kCellsOfAttributePage = 4096;
inline constexpr std::size_t kAttributesHeaderBytes = 32;

// Gathers the attributes of cells and encodes them. The same values give the same bytes. A column of integers and reals
// becomes one of reals, or of texts if an integer is no exact double. A column that also has texts becomes one of
// texts. Thread rule: thread-compatible.
class AttributeTable {
 public:
  // Cells must ascend; each cell at most once. Missing values are left out; of two values of one name, the first
  // counts.
  void add(std::uint32_t cell, const std::vector<CellAttribute>& attributes);
  bool empty() const { return columns_.empty(); }
  std::map<std::string, AttributeType> types() const;  // by column
  std::uint64_t bytes() const;                         // in memory, about
  Bytes encode(std::uint32_t cells) const;             // requires that all cells added are below `cells`

 private:
  struct Column {
    AttributeType type = AttributeType::text;
    std::vector<std::uint64_t> values;  // bits of a number, or the number of a text, by cell
    std::vector<bool> present;
    std::unordered_map<std::string, std::uint32_t> numbers;
    std::vector<std::string> texts;  // by number
    std::uint64_t text_bytes = 0;
  };
  static std::uint64_t bitsOf(Column& column, const AttributeValue& value);
  static AttributeValue valueOf(const Column& column, std::size_t cell);
  static void widen(Column& column, AttributeType type);

  std::map<std::string, Column> columns_;
};

struct AttributePart {
  std::uint64_t offset = 0, bytes = 0, checksum = 0;  // offset in the section
};
struct AttributeRoot {
  struct Column {
    std::string name;
    AttributeType type = AttributeType::text;
    std::uint64_t values = 0;
    std::uint32_t entries = 0;  // of the dictionary
    AttributePart dictionary;   // of a text column
    std::vector<AttributePart> pages;
  };
  std::uint32_t cells = 0;
  std::vector<Column> columns;
};
struct AttributeHeader {
  std::uint64_t root_bytes = 0, root_checksum = 0;
};
AttributeHeader decodeAttributeHeader(ByteSpan header, std::uint64_t section_bytes);
AttributeRoot decodeAttributeRoot(ByteSpan root, std::uint64_t section_bytes);
std::vector<std::string> decodeDictionary(ByteSpan bytes, std::uint32_t entries);

// The values of a page: for a text its place in the dictionary, else the bits of the number.
struct AttributePage {
  std::vector<std::uint64_t> values;
  std::vector<bool> present;
};
AttributePage decodeAttributePage(ByteSpan bytes, const AttributeRoot::Column& column, std::uint32_t cells);

}  // namespace filiform::internal
