#include "tools/synthetic.h"

#include "index/errors.h"
#include "tools/synthetic_neuron.h"

#include <algorithm>
#include <array>
#include <cerrno>
#include <charconv>
#include <cmath>
#include <cstdio>
#include <cstring>
#include <exception>
#include <filesystem>
#include <fstream>
#include <optional>
#include <utility>

#include <xxhash.h>
#include <zip.h>

namespace filiform::tools {

namespace {

// 2011-06-21 12:00:00, the year of the method's publication, as the DOS fields of an archive.
constexpr zip_uint16_t kDosDate = (2011 - 1980) << 9 | 6 << 5 | 21;
constexpr zip_uint16_t kDosTime = 12 << 11;

// Where a table places cells: 31 000 of them in 0.29 mm^3, a column of rat cortex.
constexpr double kPlacedRadius_um = 257;

struct Entry {
  std::string path;
  std::uint64_t number;  // of the cell
};

void appendInteger(std::string& out, std::uint64_t value) {
  char digits[20];
  out.append(digits, std::to_chars(digits, digits + sizeof digits, value).ptr);
}

// 12345 -> "12.345".
void appendThousandths(std::string& out, std::int64_t value) {
  if (value < 0) out += '-';
  const std::uint64_t magnitude = value < 0 ? 0 - static_cast<std::uint64_t>(value) : static_cast<std::uint64_t>(value);
  appendInteger(out, magnitude / 1000);
  const auto rest = static_cast<int>(magnitude % 1000);
  const char decimals[4] = {'.', static_cast<char>('0' + rest / 100), static_cast<char>('0' + rest / 10 % 10),
                            static_cast<char>('0' + rest % 10)};
  out.append(decimals, 4);
}

bool isScene(const std::string& kind) { return kind.starts_with("scene"); }

// What a column or a scene consists of, and the text of each of its files.
class Plan {
 public:
  explicit Plan(const SyntheticOptions& options) : options_(options) {
    const auto& kinds = syntheticKinds();
    if (std::find(kinds.begin(), kinds.end(), options.kind) == kinds.end())
      throw UsageError("no such kind of synthetic data; choose column, scene1, scene2 or scene3");
    if (isScene(options.kind)) {
      entries_.push_back({options.kind + ".swc", 0});
      return;
    }
    if (options.cells == 0) throw UsageError("a column needs at least one cell");
    library_ = !options.placements_out.empty();
    if (library_ && options.library == 0) throw UsageError("a library needs at least one morphology");
    const std::uint64_t files = library_ ? std::min(options.cells, options.library) : options.cells;
    const std::size_t width = std::max<std::size_t>(5, std::to_string(options.cells - 1).size());
    for (std::uint64_t i = 0; i < files; ++i) {
      std::string digits = std::to_string(i);
      digits.insert(0, width - digits.size(), '0');
      entries_.push_back({(library_ ? "library/L" : "column/L") + std::to_string(layerOfCell(options.seed, i)) +
                              "/cell_" + digits + ".swc",
                          i});
    }
    std::sort(entries_.begin(), entries_.end(), [](const Entry& a, const Entry& b) { return a.path < b.path; });
  }

  const std::vector<Entry>& entries() const { return entries_; }

  Neuron neuron(const Entry& entry) const {
    std::uint32_t tip = 0;
    return isScene(options_.kind) ? buildScene(options_.kind, tip) : growNeuron(options_.seed, entry.number, library_);
  }

  std::string text(const Entry& entry, const Neuron& neuron) const {
    std::string out;
    out.reserve(500 + neuron.samples.size() * 45);
    out += "# Synthetic, grown by filiform synth: not a reconstruction of a real cell\n";
    out += "# " + neuron.description + "\n";
    if (isScene(options_.kind)) {
      out += "# suggested route (sample ids ROOT:TIP): " + sceneRoute(options_.kind) + "\n";
    } else {
      out += "# cell " + std::to_string(entry.number) + ", seed " + std::to_string(options_.seed) + "\n";
      out += "# micrometres; y points up: white matter at 0, pia at 1400; the column is 300 wide around x = z = 0\n";
      out += "# types: 1 soma, 2 axon, 3 basal or multipolar dendrite, 4 apical dendrite\n";
    }
    out += "# id type x y z radius parent\n";
    for (std::size_t i = 0; i < neuron.samples.size(); ++i) {
      const NeuronSample& sample = neuron.samples[i];
      appendInteger(out, i + 1);
      out += ' ';
      appendInteger(out, sample.type);
      for (const std::int64_t coordinate : sample.p_nm) {
        out += ' ';
        appendThousandths(out, coordinate);
      }
      out += ' ';
      appendThousandths(out, sample.radius_nm);
      out += ' ';
      if (sample.parent == kNoParent) {
        out += "-1";
      } else {
        appendInteger(out, std::uint64_t{sample.parent} + 1);
      }
      out += '\n';
    }
    return out;
  }

 private:
  SyntheticOptions options_;
  bool library_ = false;
  std::vector<Entry> entries_;
};

std::uint64_t segmentsOf(const Neuron& neuron) {
  return static_cast<std::uint64_t>(std::count_if(neuron.samples.begin(), neuron.samples.end(),
                                                  [](const NeuronSample& s) { return s.parent != kNoParent; }));
}

// Feeds the zip library, which asks for one file after the other while it closes the archive.
class ArchiveFeed {
 public:
  ArchiveFeed(const Plan& plan, const SyntheticProgress& progress) : plan_(plan), progress_(progress) {
    readers_.resize(plan.entries().size());
    for (std::size_t i = 0; i < readers_.size(); ++i) readers_[i] = {this, i, 0};
  }

  zip_source_t* source(zip_t* archive, std::size_t index) {
    return zip_source_function(archive, &ArchiveFeed::callback, &readers_[index]);
  }

  const SyntheticSummary& summary() const { return summary_; }
  const std::exception_ptr& failure() const { return failure_; }

 private:
  struct Reader {
    ArchiveFeed* feed;
    std::size_t index;
    std::size_t at;
  };

  const std::string& text(std::size_t index) {
    if (held_ == index) return text_;
    const Entry& entry = plan_.entries()[index];
    const Neuron neuron = plan_.neuron(entry);
    text_ = plan_.text(entry, neuron);
    held_ = index;
    held_samples_ = neuron.samples.size();
    held_segments_ = segmentsOf(neuron);
    return text_;
  }

  void finished() {
    ++summary_.files;
    summary_.samples += held_samples_;
    summary_.segments += held_segments_;
    summary_.text_bytes += text_.size();
    if (progress_) progress_(summary_.files, readers_.size());
  }

  zip_int64_t answer(Reader& reader, void* data, zip_uint64_t length, zip_source_cmd_t command) {
    switch (command) {
      case ZIP_SOURCE_SUPPORTS:
        return zip_source_make_command_bitmap(ZIP_SOURCE_OPEN, ZIP_SOURCE_READ, ZIP_SOURCE_CLOSE, ZIP_SOURCE_STAT,
                                              ZIP_SOURCE_ERROR, ZIP_SOURCE_FREE, -1);
      case ZIP_SOURCE_OPEN:
        reader.at = 0;
        text(reader.index);
        return 0;
      case ZIP_SOURCE_READ: {
        const std::string& bytes = text(reader.index);
        const auto n = std::min<std::size_t>(length, bytes.size() - reader.at);
        std::memcpy(data, bytes.data() + reader.at, n);
        reader.at += n;
        // At the end of the text: the library does not listen to what closing says.
        if (n == 0 && length > 0) finished();
        return static_cast<zip_int64_t>(n);
      }
      case ZIP_SOURCE_CLOSE:
        return 0;
      case ZIP_SOURCE_STAT: {
        auto* stat = static_cast<zip_stat_t*>(data);
        zip_stat_init(stat);
        stat->size = text(reader.index).size();
        stat->valid = ZIP_STAT_SIZE;
        return sizeof *stat;
      }
      case ZIP_SOURCE_ERROR: {
        const int codes[2] = {ZIP_ER_INTERNAL, 0};
        std::memcpy(data, codes, sizeof codes);
        return sizeof codes;
      }
      case ZIP_SOURCE_FREE:
        return 0;
      default:
        return -1;
    }
  }

  static zip_int64_t callback(void* user, void* data, zip_uint64_t length, zip_source_cmd_t command) {
    Reader& reader = *static_cast<Reader*>(user);
    // No exception may pass through the C library.
    try {
      return reader.feed->answer(reader, data, length, command);
    } catch (...) {
      if (!reader.feed->failure_) reader.feed->failure_ = std::current_exception();
      return -1;
    }
  }

  const Plan& plan_;
  const SyntheticProgress& progress_;
  std::vector<Reader> readers_;
  std::optional<std::size_t> held_;
  std::string text_;
  std::uint64_t held_samples_ = 0, held_segments_ = 0;
  SyntheticSummary summary_;
  std::exception_ptr failure_;
};

[[noreturn]] void throwZip(const std::string& file, zip_error_t* error) {
  const int system_error = zip_error_system_type(error) == ZIP_ET_SYS ? zip_error_code_system(error) : 0;
  std::string what = std::string("cannot write the archive: ") + zip_error_strerror(error);
  zip_error_fini(error);
  if (system_error != 0) throw IoError(file, "cannot write the archive", system_error);
  throw IoError(file, what);
}

SyntheticSummary writeArchive(const Plan& plan, const std::string& path, const SyntheticProgress& progress) {
  zip_error_t error;
  zip_error_init(&error);
  zip_source_t* file = zip_source_file_create(path.c_str(), 0, -1, &error);
  if (file == nullptr) throwZip(path, &error);
  zip_t* archive = zip_open_from_source(file, ZIP_CREATE | ZIP_TRUNCATE, &error);
  if (archive == nullptr) {
    zip_source_free(file);
    throwZip(path, &error);
  }
  ArchiveFeed feed(plan, progress);
  const auto fail = [&] {
    zip_error_t copy;
    zip_error_init(&copy);
    const zip_error_t* from = zip_get_error(archive);
    zip_error_set(&copy, zip_error_code_zip(from), zip_error_code_system(from));
    zip_discard(archive);
    if (feed.failure()) std::rethrow_exception(feed.failure());
    throwZip(path, &copy);
  };
  for (std::size_t i = 0; i < plan.entries().size(); ++i) {
    zip_source_t* source = feed.source(archive, i);
    const zip_int64_t index =
        source == nullptr ? -1 : zip_file_add(archive, plan.entries()[i].path.c_str(), source, ZIP_FL_ENC_UTF_8);
    if (index < 0) {
      zip_source_free(source);
      fail();
    }
    const auto at = static_cast<zip_uint64_t>(index);
    // DOS fields, not a time: a time would pass through the local time zone.
    if (zip_file_set_dostime(archive, at, kDosTime, kDosDate, 0) != 0 ||
        zip_file_set_external_attributes(archive, at, 0, ZIP_OPSYS_UNIX, 0100644U << 16) != 0 ||
        zip_set_file_compression(archive, at, ZIP_CM_DEFLATE, 4) != 0)
      fail();
  }
  if (zip_close(archive) != 0) fail();
  SyntheticSummary summary = feed.summary();
  std::error_code ignored;
  summary.zip_bytes = std::filesystem::file_size(path, ignored);
  return summary;
}

// The table that places a library's morphologies: rotated about the vertical, spread over the column, depth nearly
// kept.
std::string placementTable(const SyntheticOptions& options, const Plan& plan, const std::string& archive) {
  std::vector<const Entry*> by_number(plan.entries().size());
  for (const Entry& entry : plan.entries()) by_number[entry.number] = &entry;
  std::string out = "source\tx_um\ty_um\tz_um\tqw\tqx\tqy\tqz\tname\n";
  const std::size_t width = std::max<std::size_t>(5, std::to_string(options.cells - 1).size());
  for (std::uint64_t i = 0; i < options.cells; ++i) {
    SyntheticRandom random(options.seed ^ 0x706c616365U, i);
    const Vector3d p = kPlacedRadius_um * random.inDisc();
    Vector3d turn = random.inDisc();
    while (turn.squaredNorm() < 0.01) turn = random.inDisc();
    turn.normalize();
    out += archive + "/" + by_number[i % by_number.size()]->path;
    for (const double coordinate : {p.x(), random.between(-6, 0), p.z()}) {
      out += '\t';
      appendThousandths(out, std::llround(coordinate * 1000));
    }
    for (const double component : {turn.x(), 0.0, turn.z(), 0.0}) {
      char digits[32];
      out += '\t';
      out.append(digits, std::to_chars(digits, digits + sizeof digits, component).ptr);
    }
    std::string digits = std::to_string(i);
    digits.insert(0, width - digits.size(), '0');
    out += "\tcell_" + digits + "\n";
  }
  return out;
}

}  // namespace

const std::vector<std::string>& syntheticKinds() {
  static const std::vector<std::string> kKinds{"column", "scene1", "scene2", "scene3"};
  return kKinds;
}

std::string sceneRoute(const std::string& kind) {
  const auto& kinds = syntheticKinds();
  if (!isScene(kind) || std::find(kinds.begin(), kinds.end(), kind) == kinds.end())
    throw UsageError("no such scene; choose scene1, scene2 or scene3");
  std::uint32_t tip = 0;
  buildScene(kind, tip);
  return "1:" + std::to_string(tip + 1);
}

SyntheticSummary writeSynthetic(const SyntheticOptions& options, const std::string& out_zip,
                                const SyntheticProgress& progress) {
  const Plan plan(options);
  const bool table = !options.placements_out.empty() && !isScene(options.kind);
  const std::string partial = options.placements_out + ".partial";
  if (table) {
    // The table first: it is small, and the archive appears whole by itself.
    errno = 0;
    std::ofstream out(partial, std::ios::binary | std::ios::trunc);
    out << placementTable(options, plan, std::filesystem::path(out_zip).filename().string()) << std::flush;
    if (!out) {
      const int code = errno;
      out.close();
      std::remove(partial.c_str());
      throw IoError(options.placements_out, "cannot write the table of placements", code);
    }
  }
  try {
    SyntheticSummary summary = writeArchive(plan, out_zip, progress);
    summary.cells = table ? options.cells : summary.files;
    if (table && std::rename(partial.c_str(), options.placements_out.c_str()) != 0)
      throw IoError(options.placements_out, "cannot write the table of placements", errno);
    return summary;
  } catch (...) {
    if (table) std::remove(partial.c_str());
    throw;
  }
}

struct SyntheticCells::Impl {
  Impl(const SyntheticOptions& options, std::string before) : plan(options), prefix(std::move(before)) {
    if (!prefix.empty()) prefix += '/';
  }

  Plan plan;
  std::string prefix;
  std::size_t next = 0;
};

SyntheticCells::SyntheticCells(const SyntheticOptions& options, std::string archive) {
  SyntheticOptions without_table = options;
  without_table.placements_out.clear();
  impl_ = std::make_unique<Impl>(without_table, std::move(archive));
}

SyntheticCells::~SyntheticCells() = default;

std::uint64_t SyntheticCells::cells() const { return impl_->plan.entries().size(); }

bool SyntheticCells::next(Cell& cell) {
  if (impl_->next == impl_->plan.entries().size()) return false;
  const Entry& entry = impl_->plan.entries()[impl_->next++];
  const Neuron neuron = impl_->plan.neuron(entry);
  const std::string text = impl_->plan.text(entry, neuron);
  Cell out;
  out.source = impl_->prefix + entry.path;
  out.digest = XXH3_64bits(text.data(), text.size());
  const std::size_t n = neuron.samples.size();
  out.sample_ids.reserve(n);
  out.positions_um.reserve(n);
  out.parents.reserve(n);
  out.radii_um.reserve(n);
  out.types.reserve(n);
  for (std::size_t i = 0; i < n; ++i) {
    const NeuronSample& s = neuron.samples[i];
    out.sample_ids.push_back(static_cast<std::int64_t>(i) + 1);
    // A quotient of exact integers is the double nearest to the decimal, which is what a reader of the text gets.
    out.positions_um.emplace_back(static_cast<double>(s.p_nm[0]) / 1000, static_cast<double>(s.p_nm[1]) / 1000,
                                  static_cast<double>(s.p_nm[2]) / 1000);
    out.parents.push_back(s.parent);
    out.radii_um.push_back(static_cast<float>(static_cast<double>(s.radius_nm) / 1000));
    out.types.push_back(s.type);
  }
  cell = std::move(out);
  return true;
}

}  // namespace filiform::tools
