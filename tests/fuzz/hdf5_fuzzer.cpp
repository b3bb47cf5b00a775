#include "index/attributes/internal/attributes_section.h"
#include "index/circuits/internal/node_table.h"
#include "index/errors.h"
#include "index/file/internal/digest.h"
#include "index/formats/internal/h5_morphology.h"
#include "tests/fuzz/fuzz_bytes.h"

#include <cmath>

namespace filiform::fuzz {
namespace {

using internal::Bytes;
using internal::ByteSpan;
using internal::Damage;

// Records of filiform-hdf5 as a hostile program would send them: the checksums are made valid.
Bytes sealed(Input input) {
  Bytes bytes(input.begin(), input.end());
  for (std::size_t at = 0; at + 16 <= bytes.size();) {
    std::uint32_t kind = 0, size = 0;
    std::memcpy(&kind, bytes.data() + at, 4);
    std::memcpy(&size, bytes.data() + at + 4, 4);
    kind %= 8;
    size = std::min<std::uint32_t>(size % 512, static_cast<std::uint32_t>(bytes.size() - at - 16));
    std::memcpy(bytes.data() + at, &kind, 4);
    std::memcpy(bytes.data() + at + 4, &size, 4);
    internal::storeLittle64(bytes.data() + at + 8, internal::checksum(ByteSpan(bytes).subspan(at + 16, size), kind));
    at += 16 + size;
  }
  return bytes;
}

void nodes(Input input) {
  const Bytes bytes = sealed(input);
  std::size_t at = 0;
  const internal::NodeTable table("nodes.h5", "p", [&](const internal::UseRecord& use) {
    internal::readAnswer(
        [&](std::span<std::uint8_t> to) {
          if (to.size() > bytes.size() - at) throw Damage{at, "the records end too early"};
          if (!to.empty()) std::memcpy(to.data(), bytes.data() + at, to.size());
          at += to.size();
        },
        use);
  });
  std::vector<CellAttribute> attributes;
  for (std::uint64_t node = 0; node < std::min<std::uint64_t>(table.nodes(), 64); ++node) {
    attributes.clear();
    table.attributesOf(node, attributes);
    for (const CellAttribute& attribute : attributes) textOf(attribute.value);
    textOf(table.value("x", node));
  }
}

void morphology(Input input) {
  Taker in(input);
  const std::size_t count = in.number<std::uint8_t>() % 32, sections = in.number<std::uint8_t>() % 16;
  std::vector<std::array<double, 4>> points;
  for (std::size_t i = 0; i < count; ++i) {
    points.emplace_back();
    for (double& value : points.back())
      value = in.number<std::int8_t>() == 127 ? std::nan("") : in.number<std::int8_t>();
  }
  std::vector<std::array<std::int64_t, 3>> structure;
  for (std::size_t i = 0; i < sections; ++i)
    structure.push_back({in.number<std::int8_t>(), in.number<std::int8_t>() % 5, in.number<std::int8_t>() % 8});
  SwcOptions options;
  options.soma_links = in.number<std::uint8_t>() % 2 == 0;
  Cell cell;
  const InputReport report = internal::h5Morphology(points, structure, "fuzz", options, cell);
  require(report.samples == cell.samples(), "the report counts the samples");
  require(report.candidate_lines == report.samples + report.dropped_lines + report.merged_points ||
              report.severity == Severity::kRefuse,
          "points = samples + dropped + merged");
  for (const std::uint32_t parent : cell.parents)
    require(parent == kNoParent || parent < cell.samples(), "parents are samples");
}

void attributes(Input input) {
  Taker in(input);
  internal::AttributeRoot::Column column;
  column.type = static_cast<AttributeType>(in.number<std::uint8_t>() % 3);
  column.entries = in.number<std::uint8_t>();
  const std::uint32_t cells = in.number<std::uint8_t>();
  const std::size_t choice = in.number<std::uint8_t>() % 4;
  if (choice == 0) {
    const internal::AttributePage page = internal::decodeAttributePage(in.rest(), column, cells);
    require(page.values.size() == cells && page.present.size() == cells, "a value for each cell");
    for (std::uint32_t i = 0; i < cells; ++i)
      require(column.type != AttributeType::text || !page.present[i] || page.values[i] < column.entries,
              "texts are in the dictionary");
  } else if (choice == 1) {
    require(internal::decodeDictionary(in.rest(), column.entries).size() == column.entries, "all texts");
  } else if (choice == 2) {
    internal::decodeAttributeRoot(in.rest(), 4096);
  } else {
    internal::decodeAttributeHeader(in.rest(), 4096);
  }
}

}  // namespace

// The first byte chooses: records of nodes, arrays of a morphology, or parts of the section of attributes.
void fuzzHdf5(Input input) {
  Taker in(input);
  const auto choice = in.number<std::uint8_t>() % 3;
  try {
    if (choice == 0) nodes(in.rest());
    if (choice == 1) morphology(in.rest());
    if (choice == 2) attributes(in.rest());
  } catch (const Damage&) {
  } catch (const InputError&) {
  } catch (const internal::Hdf5Failure&) {
  }
}

}  // namespace filiform::fuzz
