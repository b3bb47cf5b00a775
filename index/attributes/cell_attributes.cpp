#include "index/attributes/cell_attributes.h"

#include "index/attributes/internal/attributes_section.h"
#include "index/errors.h"
#include "index/file/internal/digest.h"
#include "index/file/internal/read_once.h"
#include "index/file/internal/set_files.h"
#include "index/set/internal/revision.h"

#include <algorithm>
#include <bit>
#include <limits>
#include <utility>

namespace filiform {

using internal::AttributePage;
using internal::AttributePart;
using internal::ByteSpan;
using internal::kCellsOfAttributePage;

struct CellAttributes::Impl {
  struct Lazy {
    internal::ReadOnce<std::vector<std::string>> dictionary;
    std::unique_ptr<internal::ReadOnce<AttributePage>[]> pages;
  };

  // Reads a part of the section and decodes it. After damage, reads once more if the source kept a copy.
  template <typename Decode>
  auto decodedPart(std::uint64_t offset, std::uint64_t size, Decode decode) const {
    for (bool again = false;; again = true) {
      const internal::Bytes part = set.read(file, offset, size);
      try {
        return internal::decoded(set.describe(file), offset, [&] { return decode(ByteSpan(part)); });
      } catch (const CorruptSet&) {
        if (again || !set.discard(file, offset, size)) throw;
      }
    }
  }
  template <typename Decode>
  auto checkedPart(const AttributePart& part, Decode decode) const {
    return decodedPart(part.offset, part.bytes, [&](ByteSpan data) {
      if (internal::checksum(data) != part.checksum) throw internal::Damage{0, "the checksum of attributes is wrong"};
      return decode(data);
    });
  }

  explicit Impl(const TileSet& tile_set) : set(tile_set), file(internal::sectionFile(internal::kAttributesSection)) {
    const auto at = std::find_if(set.files().begin(), set.files().end(),
                                 [&](const SetFile& section) { return section.name == file; });
    if (at == set.files().end()) return;
    bytes = at->bytes;
    const internal::AttributeHeader header =
        decodedPart(0, std::min<std::uint64_t>(bytes, internal::kAttributesHeaderBytes),
                    [&](ByteSpan part) { return internal::decodeAttributeHeader(part, bytes); });
    root = checkedPart({bytes - header.root_bytes, header.root_bytes, header.root_checksum},
                       [&](ByteSpan part) { return internal::decodeAttributeRoot(part, bytes); });
    if (root.cells != set.cell_count())
      throw CorruptSet(set.describe(file), 0, "has attributes of another number of cells");
    for (const internal::AttributeRoot::Column& column : root.columns) {
      columns.push_back({column.name, column.type, column.values, column.entries});
      lazy.push_back(std::make_unique<Lazy>());
      lazy.back()->pages = std::make_unique<internal::ReadOnce<AttributePage>[]>(column.pages.size());
    }
  }

  const AttributePage& page(std::uint32_t column, std::uint32_t number) const {
    return lazy.at(column)->pages[number].get([&] {
      const internal::AttributeRoot::Column& stated = root.columns[column];
      const std::uint32_t cells = std::min(kCellsOfAttributePage, root.cells - number * kCellsOfAttributePage);
      return std::make_unique<AttributePage>(checkedPart(
          stated.pages[number], [&](ByteSpan data) { return internal::decodeAttributePage(data, stated, cells); }));
    });
  }
  // Calls use(cell, bits) for each cell that has a value.
  template <typename Use>
  void forEach(std::uint32_t column, Use use) const {
    for (std::uint32_t number = 0; number < root.columns.at(column).pages.size(); ++number) {
      const AttributePage& values = page(column, number);
      for (std::uint32_t i = 0; i < values.values.size(); ++i)
        if (values.present[i]) use(number * kCellsOfAttributePage + i, values.values[i]);
    }
  }

  const TileSet& set;
  std::string file;
  std::uint64_t bytes = 0;
  internal::AttributeRoot root;
  std::vector<Column> columns;
  std::vector<std::unique_ptr<Lazy>> lazy;
};

CellAttributes::CellAttributes(const TileSet& set) : impl_(std::make_unique<Impl>(set)) {}
CellAttributes::~CellAttributes() = default;

const std::vector<CellAttributes::Column>& CellAttributes::columns() const { return impl_->columns; }

std::optional<std::uint32_t> CellAttributes::find(std::string_view name) const {
  const auto& all = impl_->columns;
  const auto at =
      std::lower_bound(all.begin(), all.end(), name, [](const Column& c, std::string_view n) { return c.name < n; });
  constexpr std::string_view kPrefix = "attribute:";
  if (at == all.end() || at->name != name)
    return name.starts_with(kPrefix) ? find(name.substr(kPrefix.size())) : std::nullopt;
  return static_cast<std::uint32_t>(at - all.begin());
}

AttributeValue CellAttributes::value(std::uint32_t column, std::uint32_t cell) const {
  const AttributePage& page = impl_->page(column, cell / kCellsOfAttributePage);
  const std::uint32_t at = cell % kCellsOfAttributePage;
  if (!page.present.at(at)) return {};
  const std::uint64_t bits = page.values[at];
  switch (impl_->columns[column].type) {
    case AttributeType::text:
      return dictionary(column)[bits];
    case AttributeType::integer:
      return static_cast<std::int64_t>(bits);
    default:
      return std::bit_cast<double>(bits);
  }
}

std::vector<CellAttribute> CellAttributes::of(std::uint32_t cell) const {
  std::vector<CellAttribute> all;
  for (std::uint32_t column = 0; column < columns().size(); ++column)
    if (AttributeValue found = value(column, cell); !isMissing(found))
      all.push_back({columns()[column].name, std::move(found)});
  return all;
}

const std::vector<std::string>& CellAttributes::dictionary(std::uint32_t column) const {
  return impl_->lazy.at(column)->dictionary.get([&] {
    const internal::AttributeRoot::Column& stated = impl_->root.columns[column];
    return std::make_unique<std::vector<std::string>>(stated.type != AttributeType::text
                                                          ? std::vector<std::string>()
                                                          : impl_->checkedPart(stated.dictionary, [&](ByteSpan data) {
                                                              return internal::decodeDictionary(data, stated.entries);
                                                            }));
  });
}

std::vector<std::uint32_t> CellAttributes::codes(std::uint32_t column) const {
  std::vector<std::uint32_t> codes(impl_->root.cells, kNoCode);
  impl_->forEach(column,
                 [&](std::uint32_t cell, std::uint64_t bits) { codes[cell] = static_cast<std::uint32_t>(bits); });
  return codes;
}

std::vector<double> CellAttributes::numbers(std::uint32_t column) const {
  std::vector<double> numbers(impl_->root.cells, std::numeric_limits<double>::quiet_NaN());
  const bool integer = columns().at(column).type == AttributeType::integer;
  impl_->forEach(column, [&](std::uint32_t cell, std::uint64_t bits) {
    numbers[cell] = integer ? static_cast<double>(static_cast<std::int64_t>(bits)) : std::bit_cast<double>(bits);
  });
  return numbers;
}

void CellAttributes::check() const {
  for (std::uint32_t column = 0; column < columns().size(); ++column) {
    dictionary(column);
    std::uint64_t values = 0;
    impl_->forEach(column, [&](std::uint32_t cell, std::uint64_t) {
      ++values;
      if (impl_->set.cell(cell).removed)
        throw CorruptSet(impl_->set.describe(impl_->file), 0, "a removed cell has attributes");
    });
    if (values != columns()[column].values)
      throw CorruptSet(impl_->set.describe(impl_->file), 0, "the number of an attribute's values is wrong");
  }
}

}  // namespace filiform
