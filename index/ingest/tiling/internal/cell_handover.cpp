// The bytes in which a rank passes on its cells.
#include "index/ingest/tiling/internal/cell_intake.h"

#include <utility>

namespace filiform::internal {
namespace {

void writeAttributes(ByteWriter& out, const std::vector<CellAttribute>& attributes) {
  out.varint(attributes.size());
  for (const CellAttribute& attribute : attributes) {
    out.sizedText(attribute.name);
    out.u8(static_cast<std::uint8_t>(attribute.value.index()));
    if (const auto* const text = std::get_if<std::string>(&attribute.value)) out.sizedText(*text);
    if (const auto* const whole = std::get_if<std::int64_t>(&attribute.value)) out.i64(*whole);
    if (const auto* const real = std::get_if<double>(&attribute.value)) out.f64(*real);
  }
}

std::vector<CellAttribute> readAttributes(ByteReader& in) {
  std::vector<CellAttribute> attributes(in.varint());
  for (CellAttribute& attribute : attributes) {
    attribute.name = in.sizedText();
    switch (in.u8()) {
      case 1:
        attribute.value = in.sizedText();
        break;
      case 2:
        attribute.value = in.i64();
        break;
      case 3:
        attribute.value = in.f64();
        break;
      default:
        break;
    }
  }
  return attributes;
}

}  // namespace

void CellIntake::handOver(ByteChain& out) {
  details_.close();
  std::size_t soma = 0;
  readDetails([&](std::uint32_t c, ByteSpan detail) {
    CellRecord& record = records_[c];
    ByteWriter cell;
    for (const std::uint64_t count : {record.samples, record.segments, record.isolated, record.roots, digests_[c]})
      cell.u64(count);
    cell.box(record.bounds);
    cell.sizedText(record.source);
    cell.sizedText(given_names_[c]);
    writeAttributes(cell, given_attributes_[c]);
    std::size_t end = soma;
    while (end < somata_.size() && somata_[end].cell == c) ++end;
    cell.varint(end - soma);
    for (; soma < end; ++soma) {
      cell.u32(somata_[soma].sample);
      cell.point(somata_[soma].p);
      cell.f32(somata_[soma].radius_um);
    }
    cell.append(detail);
    record = {};
    given_names_[c] = {};
    given_attributes_[c] = {};
    ByteWriter size;
    size.u64(cell.size());
    out.append(size.bytes());
    out.append(cell.bytes());
  });
  records_ = {};
  digests_ = {};
  given_names_ = {};
  given_attributes_ = {};
  somata_ = {};
  bytes_ = 0;
  out.close();
}

void CellIntake::take(ByteChain& handed_over) {
  std::uint64_t left = handed_over.bytes();
  ByteChain::Reader reader(handed_over, true);
  Bytes bytes;
  while (left > 0) {
    constexpr std::size_t kSizeBytes = 8;
    bytes.resize(kSizeBytes);
    reader.read(bytes.data(), kSizeBytes);
    bytes.resize(ByteReader(bytes).u64());
    reader.read(bytes.data(), bytes.size());
    left -= kSizeBytes + bytes.size();
    ByteReader in(bytes);
    TakenCell cell;
    for (std::uint64_t* const count :
         {&cell.record.samples, &cell.record.segments, &cell.record.isolated, &cell.record.roots, &cell.digest})
      *count = in.u64();
    cell.record.bounds = in.box();
    cell.record.source = in.sizedText();
    cell.record.name = in.sizedText();
    cell.attributes = readAttributes(in);
    cell.somata.resize(in.varint());
    for (SomaRoot& soma : cell.somata) {
      soma.sample = in.u32();
      soma.p = in.point();
      soma.radius_um = in.f32();
    }
    const ByteSpan detail = in.take(in.left());
    cell.detail.assign(1, 0);  // no tiles
    cell.detail.insert(cell.detail.end(), detail.begin(), detail.end());
    take(std::move(cell));
  }
}

}  // namespace filiform::internal
