#include "tests/support/scenes/faulty_set.h"

#include "index/ingest/tiling/internal/tile_writer.h"
#include "index/set/internal/cells_file.h"
#include "index/set/internal/manifest.h"
#include "index/tile/tile_codec.h"
#include "tests/support/temp_folder.h"

#include <filesystem>

namespace filiform::test {

namespace fs = std::filesystem;

void writeFaultySet(const TileStore& store, const std::string& path, const Faults& faults) {
  fs::create_directories(path + "/r");
  TileWriter writer(path + "/r", store.grid(), store.capacity());
  for (TileId t = 0; t < store.tile_count(); ++t) {
    const auto tile = store.load(t);
    std::vector<StoredSegment> segments;
    for (std::uint32_t s = 0; s < tile->segment_count(); ++s)
      segments.push_back({tile->segmentId(s), tile->nodeId(tile->child(s)).sample, tile->nodeId(tile->parent(s)).sample,
                          tile->gridPoint(tile->child(s)), tile->gridPoint(tile->parent(s)), tile->owned(s)});
    if (faults.segments) faults.segments(t, segments);
    const Tile faulty(t, tile->key(), tile->isLong(), store.grid(), segments);
    TileAppearance appearance = store.loadAppearance(t);
    appearance.radii_um.resize(faulty.owned_count());
    appearance.types.resize(faulty.owned_count());
    TileEntry entry = store.entry(t);
    entry.owned = faulty.owned_count();
    entry.stored = faulty.segment_count();
    entry.decoded_bytes = faulty.bytes();
    if (faults.entry) faults.entry(t, entry);
    writer.add(entry, encodeTile(faulty), encodeAppearance(appearance), t == store.long_tile());
  }
  std::vector<CellRecord> records;
  for (std::uint32_t c = 0; c < store.cell_count(); ++c) records.push_back(store.cell(c));
  if (faults.records) faults.records(records);
  writer.writeCells(records, std::vector<std::uint64_t>(records.size(), 0), [&](const TileWriter::UseDetail& use) {
    for (std::uint32_t c = 0; c < records.size(); ++c) {
      CellDetail detail = store.loadCellDetail(c);
      if (faults.detail) faults.detail(c, detail);
      use(internal::encodeDetail(detail));
    }
  });
  Landmarks landmarks = store.landmarks();
  if (faults.landmarks) faults.landmarks(landmarks);
  writer.writeLandmarks(landmarks);
  const std::string revision = writer.finish({});
  fs::rename(path + "/r", path + "/" + revision);
  writeBytes(path + "/CURRENT", revision + "\n");
}

void changeManifest(const std::string& path, const std::function<void(nlohmann::ordered_json&)>& change) {
  const std::string before = readBytes(path + "/CURRENT").substr(0, 18);
  auto manifest = nlohmann::ordered_json::parse(readBytes(path + "/" + before + "/manifest.json"));
  change(manifest);
  const std::string text = manifest.dump(2) + "\n", now = internal::revisionName(text);
  if (now != before) fs::rename(path + "/" + before, path + "/" + now);
  writeBytes(path + "/" + now + "/manifest.json", text);
  writeBytes(path + "/CURRENT", now + "\n");
}

void writeBoastfulSet(const TileStore& store, const std::string& path, std::uint32_t samples, bool counted) {
  Faults faults;
  faults.records = [&](std::vector<CellRecord>& records) {
    records[0].samples = samples;
    records[0].segments = samples - records[0].roots;
  };
  faults.detail = [&](std::uint32_t cell, CellDetail& detail) {
    if (cell != 0) return;
    detail.sample_ids = {};
    detail.sample_ids.add(1, samples);
  };
  writeFaultySet(store, path, faults);
  if (counted) return;
  std::uint64_t all_samples = 0, segments = 0;
  for (std::uint32_t c = 0; c < store.cell_count(); ++c)
    all_samples += store.cell(c).samples, segments += store.cell(c).segments;
  changeManifest(path, [&](nlohmann::ordered_json& manifest) {
    manifest["counts"]["samples"] = all_samples;
    manifest["counts"]["segments"] = segments;
  });
}

}  // namespace filiform::test
