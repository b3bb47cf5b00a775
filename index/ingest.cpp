#include "index/ingest.h"

#include "index/errors.h"
#include "index/internal/grid_cells.h"
#include "index/internal/output_file.h"
#include "index/internal/set_files.h"
#include "index/internal/tile_entry.h"
#include "index/samples.h"
#include "index/tile_codec.h"
#include "index/tile_writer.h"

#include <algorithm>
#include <cerrno>
#include <exception>
#include <fcntl.h>
#include <filesystem>
#include <memory>
#include <sys/file.h>
#include <thread>
#include <unistd.h>

namespace filiform {
namespace {

namespace fs = std::filesystem;
using internal::GridCells;
using internal::Placement;

constexpr const char* kCurrent = "CURRENT";

bool isTemporaryName(const std::string& name) { return name.find(".tmp-") != std::string::npos; }

// The folder of a set while one ingest works on it: locked, and left as it was found unless publish() succeeds.
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
      throw InputError(path + ": is there already and is not a tile set; choose another name");
    }
    try {
      lock();
      created_ = created;
      if (!created_) inspect(force);
      // The revision's name is known only when everything is written.
      building_ = path + "/new.tmp-" + std::to_string(::getpid());
      fs::remove_all(building_);
      fs::create_directory(building_);
    } catch (const fs::filesystem_error& e) {
      undo();
      throw IoError(path, "cannot be written", e.code().value());
    } catch (...) {
      undo();
      throw;
    }
  }
  Workshop(const Workshop&) = delete;
  Workshop& operator=(const Workshop&) = delete;
  ~Workshop() { undo(); }

  const std::string& building() const { return building_; }

  // False when that very revision is in force already, whole.
  bool publish(const std::string& revision) {
    try {
      const std::string target = path_ + "/" + revision;
      if (revision == previous_ && holds(path_)) return false;
      if (fs::exists(target)) {  // damaged, or left by a crash before CURRENT named it
        const std::string aside = target + ".tmp-" + std::to_string(::getpid());
        fs::remove_all(aside);
        fs::rename(target, aside);
      }
      fs::rename(building_, target);
      internal::syncFolder(path_);
      const std::string next = path_ + "/" + kCurrent + ".tmp-" + std::to_string(::getpid());
      fs::remove(next);
      internal::OutputFile file(next);
      const std::string text = revision + "\n";
      file.write({reinterpret_cast<const std::uint8_t*>(text.data()), text.size()});
      file.close();
      fs::rename(next, path_ + "/" + kCurrent);
      created_ = false;
      building_.clear();
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
        throw InputError(path_ + ": is not a tile set but holds other files; choose another name");
      }
    }
    if (!has_current) return;
    if (!force) throw InputError(path_ + ": is a tile set already; --force replaces it");
    try {
      const auto set = TileSet::open(path_);
      previous_ = set->revision();
    } catch (const Error&) {
      // Damaged: to be replaced.
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

  void removeOthers(const std::string& revision) noexcept {
    std::error_code ignored;  // readers hold what they opened; what cannot be removed now is removed by the next ingest
    std::vector<fs::path> others;
    for (fs::directory_iterator at(path_, ignored), end; at != end; at.increment(ignored)) {
      const std::string name = at->path().filename().string();
      if (name != revision && (internal::isRevisionName(name) || isTemporaryName(name))) others.push_back(at->path());
    }
    for (const fs::path& other : others) fs::remove_all(other, ignored);
  }

  void undo() noexcept {
    std::error_code ignored;
    if (!building_.empty()) fs::remove_all(building_, ignored);
    if (created_) fs::remove_all(path_, ignored);
    building_.clear();
    created_ = false;
    if (folder_ >= 0) ::close(folder_);
    folder_ = -1;
  }

  std::string path_, building_, previous_;
  bool created_ = false;
  int folder_ = -1;
};

struct EncodedTile {
  TileEntry entry;
  std::vector<std::uint8_t> geometry, appearance;
};

EncodedTile encode(const GridCells& cells, const Placement& placement, TileId t) {
  const std::shared_ptr<const Tile> tile = internal::buildTile(cells, placement, t);
  return {internal::entryOf(*tile), encodeTile(*tile),
          encodeAppearance(internal::buildAppearance(cells, placement, t))};
}

// Encodes a batch at a time on all threads, writes in order: so the bytes do not depend on the threads.
void writeTiles(const GridCells& cells, const Placement& placement, unsigned threads, TileWriter& writer,
                const std::function<void(std::uint64_t)>& progress) {
  constexpr std::size_t kBatch = 256;
  const std::vector<TileId> order = TileWriter::packOrder(placement.leaves, placement.has_long);
  std::vector<EncodedTile> batch;
  for (std::size_t begin = 0; begin < order.size(); begin += kBatch) {
    progress(begin);
    const std::size_t n = std::min(kBatch, order.size() - begin);
    batch.assign(n, {});
    std::atomic<std::size_t> next{0};
    const auto work = [&](std::exception_ptr& failure) {
      try {
        for (std::size_t i; (i = next.fetch_add(1)) < n;) batch[i] = encode(cells, placement, order[begin + i]);
      } catch (...) {
        failure = std::current_exception();
      }
    };
    const std::size_t helpers = std::min<std::size_t>(threads, n) - 1;
    std::vector<std::exception_ptr> failures(helpers + 1);
    {
      std::vector<std::jthread> pool;
      for (std::size_t i = 0; i < helpers; ++i) pool.emplace_back(work, std::ref(failures[i]));
      work(failures[helpers]);
    }
    for (const std::exception_ptr& failure : failures)
      if (failure) std::rethrow_exception(failure);
    for (std::size_t i = 0; i < n; ++i)
      writer.add(order[begin + i], batch[i].entry, batch[i].geometry, batch[i].appearance);
  }
}

std::vector<SegmentEnds> allSegments(const GridCells& cells) {
  std::vector<SegmentEnds> segments;
  segments.reserve(cells.sample_count());
  for (std::uint32_t c = 0; c < cells.cell_count(); ++c)
    for (std::uint32_t s = cells.begin(c); s < cells.begin(c + 1); ++s)
      if (cells.isSegment(s))
        segments.push_back({{c, s - cells.begin(c)}, cells.position(s), cells.position(cells.other(s, c))});
  return segments;
}

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

  Workshop workshop(folder, options.force);
  step("reading", 0, 0);
  const GridCells cells(stream, Grid(options.quantum_exponent), options.cancel);
  step("cutting", 0, 0);
  const Placement placement = internal::place(cells, options.capacity, options.cancel);

  TileWriter writer(workshop.building(), cells.grid(), options.capacity, placement.tile_count(), placement.has_long);
  const unsigned threads = options.threads != 0 ? options.threads : std::max(1u, std::thread::hardware_concurrency());
  writeTiles(cells, placement, threads, writer,
             [&](std::uint64_t done) { step("writing tiles", done, placement.tile_count()); });
  step("choosing sample points", 0, 0);
  writer.writeSamples(chooseSamples(allSegments(cells), cells.grid()));
  step("writing cells", 0, 0);
  const std::vector<std::vector<TileId>> owning = internal::owningTiles(cells, placement);
  writer.writeCells(
      cells.records(), [&](std::uint32_t c) { return cells.digest(c); },
      [&](std::uint32_t c) {
        CellDetail detail = cells.detail(c);
        detail.tiles = owning[c];
        return detail;
      });

  IngestResult result;
  result.revision = writer.finish(options.provenance ? options.provenance() : Provenance{});
  result.counts = writer.counts();
  result.bytes = writer.bytes();
  step("publishing", 0, 0);
  result.unchanged = !workshop.publish(result.revision);
  return result;
}

}  // namespace filiform
