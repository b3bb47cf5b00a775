#include "index/ingest/growth.h"

#include "index/attributes/cell_attributes.h"
#include "index/attributes/internal/attributes_section.h"
#include "index/errors.h"
#include "index/ingest/growth/internal/addition.h"
#include "index/ingest/growth/internal/amended_revision.h"
#include "index/ingest/growth/internal/grown_revision.h"
#include "index/ingest/growth/internal/removal.h"
#include "index/ingest/growth/internal/stored_cells.h"
#include "index/ingest/growth/internal/synced_cells.h"
#include "index/ingest/internal/make_set.h"
#include "index/levels/internal/somata_section.h"
#include "index/reports/input_report.h"
#include "index/set/internal/cells_file.h"
#include "index/set/internal/manifest.h"
#include "index/subsets/set_cells.h"
#include "index/text.h"

#include <algorithm>
#include <filesystem>
#include <map>
#include <memory>
#include <optional>
#include <set>
#include <tuple>
#include <utility>

namespace filiform {

using internal::Bytes;
using internal::ByteSpan;
using internal::GrownRevision;
using internal::SetFolder;

namespace {

IngestOptions optionsLike(const TileSet& set, IngestOptions options) {
  options.capacity = set.capacity();
  options.quantum_exponent = set.grid().exponent();
  options.force = false;
  return options;
}

Provenance provenanceOfBoth(const TileSet& base, const TileSet* added) {
  Provenance all = internal::decodeProvenance(base.readProvenance(), base.manifest());
  if (added != nullptr) {
    const Provenance more = internal::decodeProvenance(added->readProvenance(), added->manifest());
    all.sources.insert(all.sources.end(), more.sources.begin(), more.sources.end());
    for (const auto& [code, count] : more.codes) all.codes[code] += count;
    for (const auto& [ending, count] : more.passed_over) all.passed_over[ending] += count;
    std::stable_sort(all.sources.begin(), all.sources.end(), [](const auto& a, const auto& b) {
      return std::tie(a.name, a.digest, a.bytes) < std::tie(b.name, b.digest, b.bytes);
    });
    for (const auto lost : {&Provenance::refused, &Provenance::skipped}) {
      (all.*lost).insert((all.*lost).end(), (more.*lost).begin(), (more.*lost).end());
      std::stable_sort((all.*lost).begin(), (all.*lost).end(), [](const auto& a, const auto& b) {
        return std::tie(a.name, a.code, a.reason) < std::tie(b.name, b.code, b.reason);
      });
    }
  }
  return all;
}

std::map<std::string, std::vector<std::uint8_t>> sectionsOf(const TileSet& base, const TileSet* added) {
  std::map<std::string, std::vector<std::uint8_t>> sections;
  for (const TileSet* set : {added, &base})
    for (const std::string& name : set != nullptr ? set->sections() : std::vector<std::string>{})
      sections[name] = *set->section(name);
  for (const char* const made_anew :
       {internal::kSomataSection, internal::kAttributesSection, internal::kLevelsDroppedSection})
    sections.erase(made_anew);
  return sections;
}

// The name of a set that is made beside the revisions, and removed in the end.
class Aside {
 public:
  explicit Aside(const std::string& folder) : path_(internal::asideOf(folder)) {
    std::error_code ignored;
    std::filesystem::remove_all(path_, ignored);
  }
  Aside(const Aside&) = delete;
  Aside& operator=(const Aside&) = delete;
  ~Aside() {
    std::error_code ignored;
    std::filesystem::remove_all(path_, ignored);
  }
  const std::string& path() const { return path_; }

 private:
  std::string path_;
};

std::vector<const TileSet*> bothSets(const TileSet& base, const TileSet* added) {
  std::vector<const TileSet*> sets{&base};
  if (added != nullptr) sets.push_back(added);
  return sets;
}

// Makes one set of these cells of both.
IngestResult rewrite(SetFolder& folder, const TileSet& base, const TileSet* added, const internal::StoredCells& cells,
                     Provenance provenance, const IngestOptions& given) {
  IngestOptions options = optionsLike(base, given);
  options.levels = internal::wantsLevels(base);
  options.provenance = [&] { return std::move(provenance); };
  options.sections = [&] { return sectionsOf(base, added); };
  return internal::makeSet(&folder, folder.building(), options, [&](internal::Tiler& tiler) { tiler.read(cells); });
}

// Bytes in memory of a tile and a cell of a set that grows: pages, records and lists of the set and of its new
// revision. Measured: 0.7 KiB a tile, with 42 718 tiles.
constexpr std::uint64_t kBytesOfGrownTile = 1024, kBytesOfGrownCell = 1024;

void requireMemory(const std::string& path, const TileSet& base, const IngestOptions& options) {
  const std::uint64_t need = kBytesOfGrownTile * base.tile_count() + kBytesOfGrownCell * base.cell_count();
  if (need <= options.memory) return;
  throw InputError(escaped(path) + ": adding and removing take " + std::to_string((need >> 20) + 1) +
                   " MiB of memory for its " + std::to_string(base.tile_count()) + " tiles and " +
                   std::to_string(base.cell_count()) + " cells; give it by --memory");
}

// Sets of an older format are read, but do not grow.
void requireNewestFormat(const std::string& path, const TileSet& base) {
  if (base.format() == internal::kFormatVersion) return;
  throw InputError(escaped(path) + ": has format " + std::to_string(base.format()) + "; run filiform compact " +
                   escaped(path) + ", then change its cells again");
}

void refuseTwins(const TileSet& base, const TileSet& added, const std::string& path) {
  for (std::uint32_t c = 0; c < added.cell_count(); ++c)
    if (const std::string& name = added.cell(c).name; base.findCell(name))
      throw InputError(path + ": already has a cell named " + inShort(name) +
                       "; remove it first with filiform ingest --remove");
}

// Writes cells, landmarks, sections and manifest of a grown revision, and publishes it.
class Finish {
 public:
  Finish(SetFolder& folder, const TileSet& base, GrownRevision& revision)
      : folder_(folder), base_(base), revision_(revision) {}

  std::vector<CellRecord> records;
  std::vector<std::uint64_t> digests;
  Provenance provenance;
  // The attributes of a cell of the new revision; empty: those of the sets.
  std::function<std::vector<CellAttribute>(std::uint32_t cell)> attributes_now;

  // Records and digests of cells that the new revision has no longer.
  void remove(const std::vector<bool>& removed) {
    for (std::uint32_t c = 0; c < removed.size(); ++c) {
      if (!removed[c]) continue;
      records[c] = CellRecord{};
      records[c].removed = true;
      digests[c] = 0;
    }
  }
  void takeCells(const TileSet& set) {
    for (std::uint32_t c = 0; c < set.cell_count(); ++c) {
      records.push_back(set.cell(c));
      digests.push_back(set.cellDigest(c));
    }
  }
  // The detail of a cell of the base, with the tiles of the new revision.
  Bytes detailNow(std::uint32_t cell) const {
    return internal::withTiles(base_.encodedDetail(cell), [this](std::vector<TileId>& tiles) {
      for (TileId& tile : tiles) tile = revision_.tileNow(tile).value();
    });
  }
  GrowthResult publish(const Landmarks& landmarks, const TileSet* added,
                       const std::function<void(const TileWriter::UseDetail& use)>& details) {
    TileWriter& writer = revision_.writer();
    writer.writeCells(records, digests, details);
    writer.writeLandmarks(landmarks);
    for (const auto& [name, bytes] : sectionsOf(base_, added)) writer.writeSection(name, bytes);
    writeSomata(added);
    writeAttributes(added);
    const bool levels = internal::wantsLevels(base_);
    if (levels) writer.writeSection(internal::kLevelsDroppedSection, {});
    GrowthResult result;
    result.set.revision = writer.finish(provenance);
    result.set.counts = writer.counts();
    result.set.bytes = writer.bytes();
    result.tiles_kept = revision_.counts().kept;
    result.tiles_patched = revision_.counts().patched;
    result.tiles_written = revision_.counts().written;
    result.levels_dropped = levels;
    folder_.publish(result.set.revision, writer.revisionsInUse());
    return result;
  }

 private:
  void writeSomata(const TileSet* added) {
    std::vector<SomaRoot> somata = internal::storedSomata(base_);
    std::erase_if(somata, [&](const SomaRoot& soma) { return records[soma.cell].removed; });
    if (added != nullptr)
      for (SomaRoot soma : internal::storedSomata(*added)) {
        soma.cell += base_.cell_count();
        somata.push_back(soma);
      }
    if (!somata.empty()) revision_.writer().writeSection(internal::kSomataSection, internal::encodeSomata(somata));
  }

  void writeAttributes(const TileSet* added) {
    internal::AttributeTable table;
    std::uint32_t cell = 0;
    for (const TileSet* set : {&base_, added}) {
      if (set == nullptr) continue;
      const CellAttributes attributes(*set);
      for (std::uint32_t c = 0; c < set->cell_count(); ++c, ++cell)
        if (!records[cell].removed) table.add(cell, attributes_now ? attributes_now(cell) : attributes.of(c));
    }
    if (!table.empty()) revision_.writer().writeSection(internal::kAttributesSection, table.encode(cell));
  }

  SetFolder& folder_;
  const TileSet& base_;
  GrownRevision& revision_;
};

GridBox boundsWithout(const TileSet& set, const std::vector<bool>& removed) {
  GridBox bounds;
  for (std::uint32_t c = 0; c < set.cell_count(); ++c)
    if (!removed[c]) bounds.extend(set.cell(c).bounds);
  return bounds;
}

// Adds to `now` the sources of some cells of the set, unless it has them.
void keepSources(const TileSet& base, const std::vector<std::uint32_t>& cells, Provenance& now) {
  if (cells.empty()) return;
  std::set<std::string> known;
  for (const Provenance::Source& source : now.sources) known.insert(source.name);
  for (const Provenance::Source& source : sourcesOfCells(base, cells))
    if (!known.contains(source.name)) now.sources.push_back(source);
  std::stable_sort(now.sources.begin(), now.sources.end(), [](const auto& a, const auto& b) {
    return std::tie(a.name, a.digest, a.bytes) < std::tie(b.name, b.digest, b.bytes);
  });
}

}  // namespace

GrowthResult addCells(CellStream& cells, const std::string& path, const IngestOptions& given) {
  internal::checkedThreads(given);
  SetFolder folder(internal::folderName(path), SetFolder::Purpose::grow);
  const auto base = TileSet::open(path);
  requireNewestFormat(path, *base);
  requireMemory(path, *base, given);
  IngestOptions options = optionsLike(*base, given);
  options.levels = false;
  const auto step = internal::stepOf(options);
  const Aside aside(internal::folderName(path));
  ingest(cells, aside.path(), options);
  const auto added = TileSet::open(aside.path());
  refuseTwins(*base, *added, path);
  const auto segments = [](const TileSet& set) { return set.counts().segments + set.counts().isolated; };
  if (segments(*base) < 2 * segments(*added)) {
    GrowthResult result{rewrite(folder, *base, added.get(), internal::StoredCells({base.get(), added.get()}),
                                provenanceOfBoth(*base, added.get()), given)};
    result.compacted = true;
    return result;
  }
  GridBox bounds = base->bounds();
  bounds.extend(added->bounds());
  GrownRevision revision(*base, folder.building(), bounds, options.pack_bytes);
  const std::vector<bool> none;
  const internal::TilesWithout all(*base, none);
  internal::Addition addition(*base, *added, all, revision);
  addition.run([&](std::uint64_t done, std::uint64_t total) { step("adding to tiles", done, total); });
  step("writing cells", 0, 0);
  Finish finish(folder, *base, revision);
  finish.provenance = provenanceOfBoth(*base, added.get());
  finish.takeCells(*base);
  finish.takeCells(*added);
  const Landmarks landmarks = internal::withLandmarks(base->landmarks(), added->landmarks(), base->cell_count());
  const auto details = [&](const TileWriter::UseDetail& use) {
    for (std::uint32_t c = 0; c < base->cell_count(); ++c) use(finish.detailNow(c));
    for (std::uint32_t c = 0; c < added->cell_count(); ++c)
      use(internal::withTiles(added->encodedDetail(c),
                              [&](std::vector<TileId>& tiles) { tiles = addition.tilesOf(c); }));
  };
  return finish.publish(landmarks, added.get(), details);
}

GrowthResult removeCells(const std::vector<std::string>& names, const std::string& path, const IngestOptions& given) {
  internal::checkedThreads(given);
  SetFolder folder(internal::folderName(path), SetFolder::Purpose::grow);
  const auto base = TileSet::open(path);
  requireNewestFormat(path, *base);
  requireMemory(path, *base, given);
  const auto step = internal::stepOf(given);
  std::vector<bool> removed(base->cell_count(), false);
  for (const std::string& name : names) {
    const auto cell = base->findCell(name);
    if (!cell) throw UsageError(path + ": has no cell named " + inShort(name) + "; filiform cells lists the names");
    removed[*cell] = true;
  }
  const GridBox bounds = boundsWithout(*base, removed);
  GrownRevision revision(*base, folder.building(), bounds, given.pack_bytes);
  internal::removeFromTiles(*base, removed, revision,
                            [&](std::uint64_t done, std::uint64_t total) { step("removing from tiles", done, total); });
  step("writing cells", 0, 0);
  Finish finish(folder, *base, revision);
  finish.provenance = provenanceOfBoth(*base, nullptr);
  finish.takeCells(*base);
  finish.remove(removed);
  const Landmarks landmarks = internal::withoutCells(*base, removed, bounds);
  return finish.publish(landmarks, nullptr, [&](const TileWriter::UseDetail& use) {
    const Bytes none = internal::encodeDetail({});
    for (std::uint32_t c = 0; c < base->cell_count(); ++c) use(removed[c] ? none : finish.detailNow(c));
  });
}

SyncResult syncCells(CellStream& cells, const std::string& path, const SyncOptions& sync, const IngestOptions& given) {
  internal::checkedThreads(given);
  SetFolder folder(internal::folderName(path), SetFolder::Purpose::grow);
  const auto base = TileSet::open(path);
  requireNewestFormat(path, *base);
  requireMemory(path, *base, given);
  IngestOptions options = optionsLike(*base, given);
  options.levels = false;
  options.provenance = {};
  const auto step = internal::stepOf(options);
  internal::SyncedCells synced(cells, *base);
  const Aside aside(internal::folderName(path));
  std::unique_ptr<TileSet> added;
  if (synced.any()) {
    ingest(synced, aside.path(), options);
    added = TileSet::open(aside.path());
  }
  Provenance now = given.provenance ? given.provenance() : Provenance{};
  synced.finish(now.unusable, sync.remove);
  if (sync.fates) sync.fates(synced.fates());
  for (const Provenance::Lost& input : now.refused)
    if (sync.remove && input.code == name(InputCode::E_UNREADABLE))
      throw InputError(escaped(input.name) + ": cannot be read (" + input.reason +
                       "), so its cells may only seem gone; mend it, or leave out --delete; nothing was changed");
  keepSources(*base, synced.staying(), now);

  SyncResult result;
  result.counts = synced.counts();
  const std::vector<bool>& removed = synced.removed();
  const std::vector<std::string> names = synced.names();
  const CellAttributes base_attributes(*base);
  const auto added_attributes = added != nullptr ? std::make_unique<CellAttributes>(*added) : nullptr;
  const auto attributes_now = [&](std::uint32_t cell) {
    return synced.attributes(cell, base_attributes, added_attributes.get());
  };
  const bool any_removed = result.counts.removed + result.counts.changed > 0;
  if (added == nullptr && !any_removed && result.counts.renamed == 0) {
    internal::AttributeTable table;
    for (std::uint32_t c = 0; c < base->cell_count(); ++c)
      if (!base->cell(c).removed) table.add(c, attributes_now(c));
    result.set.revision = internal::publishAmended(
        folder, *base, {{internal::kAttributesSection, table.empty() ? Bytes() : table.encode(base->cell_count())}},
        &now);
    const auto published = TileSet::open(path);
    result.set.counts = published->counts();
    result.set.bytes = published->bytes();
    result.set.unchanged = result.set.revision == base->revision();
    result.tiles_kept = base->tile_count();
    return result;
  }
  std::uint64_t kept_segments = 0;
  for (std::uint32_t c = 0; c < base->cell_count(); ++c)
    if (!removed[c]) kept_segments += base->cell(c).segments + base->cell(c).isolated;
  if (added != nullptr && kept_segments < 2 * (added->counts().segments + added->counts().isolated)) {
    const internal::StoredCells all(bothSets(*base, added.get()), removed,
                                    [&](std::uint32_t cell, internal::TakenCell& taken) {
                                      taken.record.name = names[cell];
                                      taken.attributes = attributes_now(cell);
                                    });
    result.set = rewrite(folder, *base, added.get(), all, std::move(now), given);
    result.compacted = true;
    return result;
  }
  GridBox bounds = boundsWithout(*base, removed);
  if (added != nullptr) bounds.extend(added->bounds());
  GrownRevision revision(*base, folder.building(), bounds, options.pack_bytes);
  const internal::TilesWithout without(*base, removed);
  std::optional<internal::Addition> addition;
  const auto tell = [&](std::uint64_t done, std::uint64_t total) { step("changing tiles", done, total); };
  if (added != nullptr)
    addition.emplace(*base, *added, without, revision).run(tell);
  else
    internal::removeFromTiles(*base, removed, revision, tell);
  step("writing cells", 0, 0);
  Finish finish(folder, *base, revision);
  finish.provenance = std::move(now);
  finish.attributes_now = attributes_now;
  finish.takeCells(*base);
  if (added != nullptr) finish.takeCells(*added);
  for (std::uint32_t c = 0; c < names.size(); ++c) finish.records[c].name = names[c];
  finish.remove(removed);
  Landmarks landmarks = internal::withoutCells(*base, removed, boundsWithout(*base, removed));
  if (added != nullptr) landmarks = internal::withLandmarks(landmarks, added->landmarks(), base->cell_count());
  static_cast<GrowthResult&>(result) = finish.publish(landmarks, added.get(), [&](const TileWriter::UseDetail& use) {
    const Bytes none = internal::encodeDetail({});
    for (std::uint32_t c = 0; c < base->cell_count(); ++c) use(finish.records[c].removed ? none : finish.detailNow(c));
    for (std::uint32_t c = 0; added != nullptr && c < added->cell_count(); ++c)
      use(internal::withTiles(added->encodedDetail(c),
                              [&](std::vector<TileId>& tiles) { tiles = addition->tilesOf(c); }));
  });
  return result;
}

GrowthResult compactSet(const std::string& path, const IngestOptions& options) {
  SetFolder folder(internal::folderName(path), SetFolder::Purpose::grow);
  const auto base = TileSet::open(path);
  GrowthResult result{
      rewrite(folder, *base, nullptr, internal::StoredCells({base.get()}), provenanceOfBoth(*base, nullptr), options)};
  result.compacted = true;
  return result;
}

}  // namespace filiform
