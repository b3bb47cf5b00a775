#include "index/build/ingest.h"

#include "index/build/internal/heap.h"
#include "index/build/internal/tile_writer.h"
#include "index/build/internal/tiler.h"
#include "index/errors.h"
#include "index/file/internal/output_file.h"
#include "index/set/internal/set_files.h"
#include "index/set/internal/tile_entry.h"
#include "index/set/landmarks.h"
#include "index/tile/tile_codec.h"

#include <algorithm>
#include <cerrno>
#include <deque>
#include <fcntl.h>
#include <filesystem>
#include <memory>
#include <new>
#include <sys/file.h>
#include <thread>
#include <unistd.h>
#include <utility>

namespace filiform {
namespace {

namespace fs = std::filesystem;

constexpr const char* kCurrent = "CURRENT";
constexpr unsigned kMostIngestThreads = 256;
constexpr std::uint64_t kMemoryOfThread = std::uint64_t{16} << 20;  // stack, buffers, arena and a tile at work

bool isTemporaryName(const std::string& name) { return name.find(".tmp-") != std::string::npos; }

// The folder of a set during one ingest. It is locked, and restored unless publish() succeeds.
class Workshop {
 public:
  Workshop(const std::string& path, bool force) : path_(path) {
    std::error_code error;
    const fs::file_status status = fs::status(path, error);
    bool created = false;
    if (!fs::exists(status)) {
      created = fs::create_directory(path, error);
      if (error) throw IoError(path, "cannot be created", error.value());
    } else if (!fs::is_directory(status)) {
      throw InputError(path + ": exists and is not a tile set; choose another name");
    }
    try {
      lock();
      created_ = created;
      if (!created_) inspect(force);
      // The revision's name is known only after everything is written.
      building_ = path + "/new.tmp-" + std::to_string(::getpid());
      fs::remove_all(building_);
      fs::create_directory(building_);
    } catch (const fs::filesystem_error& e) {
      undo();
      if (created) fs::remove(path, error);  // fails if another process already uses it
      throw IoError(path, "cannot be written", e.code().value());
    } catch (...) {
      undo();
      if (created) fs::remove(path, error);
      throw;
    }
  }
  Workshop(const Workshop&) = delete;
  Workshop& operator=(const Workshop&) = delete;
  ~Workshop() { undo(); }

  const std::string& building() const { return building_; }

  // Returns false if the same revision is already published and complete.
  bool publish(const std::string& revision) {
    try {
      const std::string target = path_ + "/" + revision;
      if (revision == previous_ && holds(path_)) {
        removeOthers(revision);
        return false;
      }
      const std::string own = ".tmp-" + std::to_string(::getpid());
      if (fs::exists(target)) {  // damaged, or left by a crash before CURRENT was written
        fs::remove_all(target + own);
        fs::rename(target, target + own);
        aside_ = target + own;
      }
      target_ = target;
      fs::rename(building_, target);
      internal::syncFolder(path_);
      const std::string next = path_ + "/" + kCurrent + own;
      fs::remove(next);
      next_ = next;
      internal::OutputFile file(next);
      const std::string text = revision + "\n";
      file.write({reinterpret_cast<const std::uint8_t*>(text.data()), text.size()});
      file.close();
      fs::rename(next, path_ + "/" + kCurrent);
      created_ = false;
      for (std::string* undone : {&building_, &target_, &aside_, &next_}) undone->clear();
      internal::syncFolder(path_);
      const fs::path parent = fs::path(path_).parent_path();
      internal::syncFolder(parent.empty() ? "." : parent.string());
    } catch (const fs::filesystem_error& e) {
      throw IoError(path_, "cannot be published", e.code().value());
    }
    removeOthers(revision);
    return true;
  }

 private:
  void lock() {
    folder_ = ::open(path_.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC);
    if (folder_ < 0) throw IoError(path_, "cannot be opened", errno);
    if (::flock(folder_, LOCK_EX | LOCK_NB) != 0) {
      if (errno == EWOULDBLOCK) throw InputError(path_ + ": another ingest is writing this set; wait for it");
      throw IoError(path_, "cannot be locked", errno);
    }
  }

  void inspect(bool force) {
    bool has_current = false;
    for (const fs::directory_entry& entry : fs::directory_iterator(path_)) {
      const std::string name = entry.path().filename().string();
      if (name == kCurrent) {
        has_current = true;
      } else if (!internal::isRevisionName(name) && !isTemporaryName(name)) {
        throw InputError(path_ + ": is not a tile set and holds other files; choose another name");
      }
    }
    if (!has_current) return;
    if (!force) throw InputError(path_ + ": is already a tile set; --force replaces it");
    try {
      const auto set = TileSet::open(path_);
      previous_ = set->revision();
    } catch (const Error&) {
      // Damaged: will be replaced.
    }
  }

  static bool holds(const std::string& path) {
    try {
      const auto set = TileSet::open(path);
      for (const SetFile& file : set->files()) set->checkFile(file);
      return true;
    } catch (const Error&) {
      return false;
    }
  }

  // Readers keep their open files. The next ingest removes what cannot be removed now.
  void removeOthers(const std::string& revision) noexcept {
    try {
      std::error_code ignored;
      std::vector<fs::path> others;
      for (fs::directory_iterator at(path_, ignored), end; at != end; at.increment(ignored)) {
        const std::string name = at->path().filename().string();
        if (name != revision && (internal::isRevisionName(name) || isTemporaryName(name))) others.push_back(at->path());
      }
      for (const fs::path& other : others) fs::remove_all(other, ignored);
    } catch (const std::bad_alloc&) {
    }
  }

  void undo() noexcept {
    try {
      std::error_code ignored;
      removeMade();
      if (!aside_.empty()) {
        fs::remove_all(target_, ignored);
        fs::rename(aside_, target_, ignored);
      }
      if (created_) fs::remove_all(path_, ignored);
      if (folder_ >= 0) ::close(std::exchange(folder_, -1));
      removeMade();                              // listing needs one more file descriptor
      if (created_) fs::remove(path_, ignored);  // fails if another process already uses it
    } catch (const std::bad_alloc&) {
      // Without memory nothing can be removed; the next ingest removes it.
    }
    for (std::string* undone : {&building_, &target_, &aside_, &next_}) undone->clear();
    created_ = false;
    if (folder_ >= 0) ::close(std::exchange(folder_, -1));
  }

  void removeMade() const {
    std::error_code ignored;
    for (const std::string* made : {&building_, &next_})
      if (!made->empty()) fs::remove_all(*made, ignored);
    if (!target_.empty() && aside_.empty()) fs::remove_all(target_, ignored);
  }

  std::string path_, previous_;
  std::string building_, target_, aside_, next_;  // to be undone; empty: none
  bool created_ = false;
  int folder_ = -1;
};

// Encodes tiles as they arrive, and stores the bytes until their positions in the packs are known.
class TileStack final : public internal::TileSink {
 public:
  TileStack(const Grid& grid, unsigned threads, const std::string& folder, std::uint64_t memory)
      : grid_(grid), spool_(folder, kBlockBytes, memory) {
    for (unsigned i = 0; i < threads; ++i) heaps_.push_back({internal::Chain(spool_), {}});
  }

  void add(unsigned worker, std::uint32_t leaf, const BlockKey& key, bool is_long, std::vector<StoredSegment>& segments,
           TileAppearance& appearance) override {
    const Tile tile(0, key, is_long, grid_, std::move(segments));
    Heap& heap = heaps_[worker];
    const std::vector<std::uint8_t> geometry = encodeTile(tile), look = encodeAppearance(appearance);
    heap.tiles.push_back({internal::entryOf(tile), leaf, worker, heap.bytes.bytes(), geometry.size(), look.size()});
    heap.bytes.append(geometry);
    heap.bytes.append(look);
  }

  struct Encoded {
    TileEntry entry;
    std::uint32_t leaf;
    unsigned heap;
    std::uint64_t offset;
    std::size_t geometry_bytes, appearance_bytes;
  };
  // All tiles, by leaf; the position is the tile's id.
  std::vector<Encoded> finish() {
    std::vector<Encoded> all;
    std::size_t size = 0;
    for (const Heap& heap : heaps_) size += heap.tiles.size();
    all.reserve(size);
    for (Heap& heap : heaps_) {
      heap.bytes.close();
      all.insert(all.end(), heap.tiles.begin(), heap.tiles.end());
      heap.tiles = {};
    }
    std::sort(all.begin(), all.end(), [](const Encoded& a, const Encoded& b) { return a.leaf < b.leaf; });
    return all;
  }
  void write(TileId id, const Encoded& tile, TileWriter& writer) {
    bytes_.resize(tile.geometry_bytes + tile.appearance_bytes);
    heaps_[tile.heap].bytes.read(tile.offset, bytes_, scratch_);
    const std::span<const std::uint8_t> all(bytes_);
    writer.add(id, tile.entry, all.first(tile.geometry_bytes), all.subspan(tile.geometry_bytes));
  }

 private:
  static constexpr std::size_t kBlockBytes = std::size_t{64} << 10;
  struct Heap {
    internal::Chain bytes;
    std::deque<Encoded> tiles;  // a growing vector would need twice the memory
  };
  Grid grid_;
  internal::Spool spool_;
  std::vector<Heap> heaps_;
  internal::Spool::Buffer scratch_;
  std::vector<std::uint8_t> bytes_;
};

}  // namespace

IngestResult ingest(CellStream& stream, const std::string& path, const IngestOptions& options) {
  if (options.capacity == 0) throw UsageError("the capacity of a tile must be at least 1");
  if (options.quantum_exponent < Grid::kMinExponent || options.quantum_exponent > Grid::kMaxExponent)
    throw UsageError("the quantum must be a power of two from 2^-10 to 2^10 um");
  std::string folder = path;
  while (folder.size() > 1 && folder.back() == '/') folder.pop_back();
  const auto step = [&](const char* phase, std::uint64_t done, std::uint64_t total) {
    if (options.cancel != nullptr && options.cancel->load(std::memory_order_relaxed)) throw Interrupted("interrupted");
    if (options.progress) options.progress(phase, done, total);
  };

  if (options.memory < kMinIngestMemory)
    throw UsageError("ingest needs at least " + std::to_string(kMinIngestMemory >> 20) + " MiB of memory");
  const unsigned wanted = options.threads != 0 ? options.threads : std::max(1u, std::thread::hardware_concurrency());
  const auto threads =
      static_cast<unsigned>(std::min<std::uint64_t>({wanted, kMostIngestThreads, options.memory / kMemoryOfThread}));
  internal::unmapLargeBlocksWhenFreed();

  Workshop workshop(folder, options.force);
  const Grid grid(options.quantum_exponent);
  internal::Tiler tiler({.grid = grid,
                         .capacity = options.capacity,
                         .memory = options.memory,
                         .beside = options.stream_bytes,
                         .chunk_segments = options.chunk_segments,
                         .threads = threads,
                         .folder = workshop.building(),
                         .cancel = options.cancel,
                         .progress = step});
  tiler.read(stream);
  tiler.cut();
  auto stack = std::make_unique<TileStack>(grid, threads, workshop.building(),
                                           options.chunk_segments != 0 ? 0 : options.memory / 8);
  tiler.tiles(*stack);
  std::vector<TileStack::Encoded> tiles = stack->finish();

  const auto leaf_count = static_cast<std::uint32_t>(tiler.leaves().size());
  const bool has_long = !tiles.empty() && tiles.back().leaf == leaf_count;
  TileWriter writer(workshop.building(), grid, options.capacity, static_cast<TileId>(tiles.size()), has_long,
                    options.pack_bytes);
  step("choosing landmarks", 0, 0);
  writer.writeLandmarks(tiler.samples());
  std::vector<BlockKey> keys;
  std::vector<TileId> tile_of(leaf_count + 1, kNoTile);
  for (TileId t = 0; t < tiles.size(); ++t) {
    tile_of[tiles[t].leaf] = t;
    if (tiles[t].leaf < leaf_count) keys.push_back(tiles[t].entry.key);
  }
  const std::size_t tile_count = tiles.size();
  std::uint64_t written = 0;
  for (const TileId t : TileWriter::packOrder(keys, has_long)) {
    if (written % 256 == 0) step("packing", written, tiles.size());
    stack->write(t, tiles[t], writer);
    ++written;
  }
  tiles = {};
  keys = {};
  stack.reset();
  if (options.levels)
    writer.writeLevels(tiler.memoryForLevels(), threads,
                       [&](std::uint64_t done) { step("levels of detail", done, tile_count); });
  step("writing cells", 0, 0);
  writer.writeCells(tiler.records(), tiler.digests(), [&](const auto& use) { tiler.details(tile_of, use); });

  IngestResult result;
  result.spool_bytes = tiler.spool_file_bytes();
  result.revision = writer.finish(options.provenance ? options.provenance() : Provenance{});
  result.counts = writer.counts();
  result.bytes = writer.bytes();
  step("publishing", 0, 0);
  result.unchanged = !workshop.publish(result.revision);
  return result;
}

}  // namespace filiform
