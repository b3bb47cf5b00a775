#include "index/attributes/internal/attributes_section.h"

#include "index/file/internal/digest.h"
#include "index/file/internal/set_files.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <numeric>
#include <utility>

namespace filiform::internal {
namespace {

constexpr std::string_view kAttributesMagic = "FILIATTR";
constexpr std::uint64_t kMostColumns = 65536;

std::uint32_t attributePages(std::uint32_t cells) {
  return cells / kCellsOfAttributePage + (cells % kCellsOfAttributePage != 0);
}

void writePart(ByteWriter& out, const AttributePart& part) {
  out.u64(part.offset);
  out.u64(part.bytes);
  out.u64(part.checksum);
}

AttributePart readPart(ByteReader& in, std::uint64_t section_bytes) {
  AttributePart part;
  part.offset = in.u64();
  part.bytes = in.u64();
  part.checksum = in.u64();
  in.require(part.offset <= section_bytes && part.bytes <= section_bytes - part.offset,
             "a part of an attribute lies outside the section");
  return part;
}

Bytes encodePage(const std::vector<std::uint64_t>& values, const std::vector<bool>& present, AttributeType type,
                 int code_bits) {
  ByteWriter page;
  std::vector<std::uint64_t> flags(present.begin(), present.end());
  packBits(page, flags, 1);
  std::uint64_t last = 0;
  std::vector<std::uint64_t> codes;
  for (std::size_t i = 0; i < values.size(); ++i) {
    if (!present[i]) continue;
    if (type == AttributeType::text) {
      codes.push_back(values[i]);
    } else if (type == AttributeType::integer) {
      page.varint(zigzag(static_cast<std::int64_t>(values[i] - last)));  // modulo 2^64
      last = values[i];
    } else {
      page.u64(values[i]);
    }
  }
  if (type == AttributeType::text) packBits(page, codes, code_bits);
  return page.take();
}

}  // namespace

std::uint64_t AttributeTable::bitsOf(Column& column, const AttributeValue& value) {
  if (column.type == AttributeType::integer) return static_cast<std::uint64_t>(std::get<std::int64_t>(value));
  if (column.type == AttributeType::real) return std::bit_cast<std::uint64_t>(*numberOf(value) + 0.0);
  const auto [at, added] =
      column.numbers.try_emplace(filiform::textOf(value), static_cast<std::uint32_t>(column.texts.size()));
  if (added) {
    column.texts.push_back(at->first);
    column.text_bytes += 2 * at->first.size() + 128;
  }
  return at->second;
}

AttributeValue AttributeTable::valueOf(const Column& column, std::size_t cell) {
  if (!column.present[cell]) return {};
  if (column.type == AttributeType::text) return column.texts[column.values[cell]];
  if (column.type == AttributeType::integer) return static_cast<std::int64_t>(column.values[cell]);
  return std::bit_cast<double>(column.values[cell]);
}

// Changes the type of a column so that it can also hold values of `type`.
void AttributeTable::widen(Column& column, AttributeType type) {
  if (column.type == AttributeType::text || column.type == type) return;
  AttributeType wide = type == AttributeType::text ? AttributeType::text : AttributeType::real;
  if (wide == AttributeType::real && column.type == AttributeType::integer)
    for (std::size_t i = 0; i < column.values.size(); ++i)
      if (column.present[i] && !isExactReal(static_cast<std::int64_t>(column.values[i]))) wide = AttributeType::text;
  if (wide == column.type) return;
  Column wider;
  wider.type = wide;
  wider.present = column.present;
  for (std::size_t i = 0; i < column.values.size(); ++i)
    wider.values.push_back(column.present[i] ? bitsOf(wider, valueOf(column, i)) : 0);
  column = std::move(wider);
}

void AttributeTable::add(std::uint32_t cell, const std::vector<CellAttribute>& attributes) {
  for (const CellAttribute& attribute : attributes) {
    const double* const real = std::get_if<double>(&attribute.value);
    if (isMissing(attribute.value) || (real != nullptr && std::isnan(*real))) continue;
    const auto [at, added] = columns_.try_emplace(attribute.name);
    Column& column = at->second;
    if (column.values.size() > cell) continue;  // of one name, the first
    AttributeType type = typeOf(attribute.value);
    const auto* const integer = std::get_if<std::int64_t>(&attribute.value);
    if (added) {
      column.type = type;
    } else {
      if (column.type == AttributeType::real && integer != nullptr && !isExactReal(*integer))
        type = AttributeType::text;
      widen(column, type);
    }
    const std::uint64_t bits = bitsOf(column, attribute.value);
    column.values.resize(cell, 0);
    column.present.resize(cell, false);
    column.values.push_back(bits);
    column.present.push_back(true);
  }
}

std::map<std::string, AttributeType> AttributeTable::types() const {
  std::map<std::string, AttributeType> types;
  for (const auto& [name, column] : columns_) types[name] = column.type;
  return types;
}

std::uint64_t AttributeTable::bytes() const {
  std::uint64_t sum = 0;
  for (const auto& [name, column] : columns_)
    sum += 2 * name.size() + 256 + column.values.capacity() * 8 + column.present.capacity() / 8 + column.text_bytes;
  return sum;
}

Bytes AttributeTable::encode(std::uint32_t cells) const {
  ByteWriter parts;
  AttributeRoot root;
  root.cells = cells;
  const auto place = [&](const Bytes& bytes) {
    const AttributePart part{kAttributesHeaderBytes + parts.size(), bytes.size(), checksum(bytes)};
    parts.append(bytes);
    return part;
  };
  for (const auto& [name, column] : columns_) {
    AttributeRoot::Column out;
    out.name = name;
    out.type = column.type;
    out.values = static_cast<std::uint64_t>(std::count(column.present.begin(), column.present.end(), true));
    // Texts that no cell has any more are left out.
    std::vector<std::uint32_t> order, code_of(column.texts.size(), 0);
    if (column.type == AttributeType::text) {
      std::vector<bool> used(column.texts.size(), false);
      for (std::size_t i = 0; i < column.values.size(); ++i)
        if (column.present[i]) used[column.values[i]] = true;
      for (std::uint32_t i = 0; i < used.size(); ++i)
        if (used[i]) order.push_back(i);
      std::sort(order.begin(), order.end(),
                [&texts = column.texts](std::uint32_t a, std::uint32_t b) { return texts[a] < texts[b]; });
      ByteWriter dictionary;
      for (std::uint32_t code = 0; code < order.size(); ++code) {
        code_of[order[code]] = code;
        dictionary.varint(column.texts[order[code]].size());
        dictionary.text(column.texts[order[code]]);
      }
      out.entries = static_cast<std::uint32_t>(order.size());
      out.dictionary = place(dictionary.take());
    }
    const int code_bits = bitsFor(order.empty() ? 0 : order.size() - 1);
    for (std::uint64_t begin = 0; begin < cells; begin += kCellsOfAttributePage) {
      const std::uint64_t end = std::min<std::uint64_t>(cells, begin + kCellsOfAttributePage);
      std::vector<std::uint64_t> values;
      std::vector<bool> present;
      for (std::uint64_t i = begin; i < end; ++i) {
        const bool there = i < column.present.size() && column.present[i];
        present.push_back(there);
        values.push_back(!there                               ? 0
                         : column.type == AttributeType::text ? code_of[column.values[i]]
                                                              : column.values[i]);
      }
      out.pages.push_back(place(encodePage(values, present, column.type, code_bits)));
    }
    root.columns.push_back(std::move(out));
  }
  ByteWriter encoded;
  encoded.u32(root.cells);
  encoded.u32(static_cast<std::uint32_t>(root.columns.size()));
  for (const AttributeRoot::Column& column : root.columns) {
    encoded.sizedText(column.name);
    encoded.u8(static_cast<std::uint8_t>(column.type));
    encoded.u64(column.values);
    encoded.u32(column.entries);
    if (column.type == AttributeType::text) writePart(encoded, column.dictionary);
    for (const AttributePart& page : column.pages) writePart(encoded, page);
  }
  ByteWriter out;
  writeMagic(out, kAttributesMagic);
  out.u32(0);
  out.u64(encoded.size());
  out.u64(checksum(encoded.bytes()));
  out.append(parts.bytes());
  out.append(encoded.bytes());
  return out.take();
}

AttributeHeader decodeAttributeHeader(ByteSpan header, std::uint64_t section_bytes) {
  ByteReader in(header);
  checkMagic(in, kAttributesMagic);
  in.require(in.u32() == 0, "a reserved field is not zero");
  AttributeHeader found;
  found.root_bytes = in.u64();
  found.root_checksum = in.u64();
  in.require(section_bytes >= kAttributesHeaderBytes && found.root_bytes <= section_bytes - kAttributesHeaderBytes,
             "the root of the attributes is larger than the section");
  return found;
}

AttributeRoot decodeAttributeRoot(ByteSpan bytes, std::uint64_t section_bytes) {
  ByteReader in(bytes);
  AttributeRoot root;
  root.cells = in.u32();
  const std::uint32_t columns = in.u32();
  in.require(columns <= kMostColumns && columns <= in.left(), "more attributes than there are bytes");
  const std::uint32_t pages = attributePages(root.cells);
  for (std::uint32_t c = 0; c < columns; ++c) {
    AttributeRoot::Column column;
    column.name = in.sizedText();
    in.require(c == 0 || root.columns.back().name < column.name, "the attributes are out of order");
    const std::uint8_t type = in.u8();
    in.require(type <= 2, "the type of an attribute is unknown");
    column.type = static_cast<AttributeType>(type);
    column.values = in.u64();
    column.entries = in.u32();
    in.require(column.values <= root.cells, "more values than cells");
    in.require(column.type == AttributeType::text ? column.entries <= column.values : column.entries == 0,
               "more entries than values");
    if (column.type == AttributeType::text) {
      column.dictionary = readPart(in, section_bytes);
      in.require(column.dictionary.bytes >= column.entries, "more entries than bytes");
    }
    in.require(in.left() / 24 >= pages, "more pages than there are bytes");
    for (std::uint32_t p = 0; p < pages; ++p) column.pages.push_back(readPart(in, section_bytes));
    root.columns.push_back(std::move(column));
  }
  in.require(in.left() == 0, "bytes beyond the end of the attributes");
  return root;
}

std::vector<std::string> decodeDictionary(ByteSpan bytes, std::uint32_t entries) {
  ByteReader in(bytes);
  std::vector<std::string> texts;
  for (std::uint32_t i = 0; i < entries; ++i) {
    texts.push_back(in.sizedText());
    in.require(i == 0 || texts[i - 1] < texts[i], "the texts are out of order");
  }
  in.require(in.left() == 0, "bytes beyond the end of the texts");
  return texts;
}

AttributePage decodeAttributePage(ByteSpan bytes, const AttributeRoot::Column& column, std::uint32_t cells) {
  ByteReader in(bytes);
  std::vector<std::uint64_t> flags(cells);
  unpackBits(in, flags, 1);
  AttributePage page;
  page.present.assign(flags.begin(), flags.end());
  page.values.assign(cells, 0);
  const auto count = static_cast<std::size_t>(std::accumulate(flags.begin(), flags.end(), std::uint64_t{0}));
  std::vector<std::uint64_t> codes(column.type == AttributeType::text ? count : 0);
  if (column.type == AttributeType::text) unpackBits(in, codes, bitsFor(column.entries == 0 ? 0 : column.entries - 1));
  std::uint64_t last = 0;
  std::size_t next = 0;
  for (std::uint32_t i = 0; i < cells; ++i) {
    if (!page.present[i]) continue;
    if (column.type == AttributeType::text) {
      in.require(codes[next] < column.entries, "a text is not in the dictionary");
      page.values[i] = codes[next++];
    } else if (column.type == AttributeType::integer) {
      page.values[i] = last += static_cast<std::uint64_t>(unzigzag(in.varint()));
    } else {
      page.values[i] = in.u64();
      in.require(!std::isnan(std::bit_cast<double>(page.values[i])), "a value is not a number");
    }
  }
  in.require(in.left() == 0, "bytes beyond the end of the values");
  return page;
}

}  // namespace filiform::internal
