#include "index/hdf5/program/file_reader.h"

#include <algorithm>
#include <cctype>
#include <cstdlib>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <hdf5.h>
#include <map>
#include <optional>
#include <set>
#include <string>
#include <system_error>
#include <utility>
#include <vector>

namespace filiform::hdf5 {
namespace {

constexpr std::uint64_t kMostPacked = 1100;      // bytes that a byte of a file can stand for
constexpr std::uint64_t kUnpackedSlack = 65536;  // bytes that even an empty file may claim
constexpr int kMostDepth = 8;

// An HDF5 object that is closed at the end.
class Handle {
 public:
  using Close = herr_t (*)(hid_t);
  Handle(hid_t id, Close close) : id_(id), close_(close) {}
  Handle(Handle&& other) noexcept : id_(std::exchange(other.id_, -1)), close_(other.close_) {}
  Handle(const Handle&) = delete;
  Handle& operator=(Handle&& other) noexcept {
    std::swap(id_, other.id_);
    std::swap(close_, other.close_);
    return *this;
  }
  ~Handle() {
    if (id_ >= 0) close_(id_);
  }
  operator hid_t() const { return id_; }  // NOLINT: as the library takes it
  bool good() const { return id_ >= 0; }

 private:
  hid_t id_;
  Close close_;
};

std::string inQuotes(const std::string& name) { return "'" + name.substr(0, 200) + "'"; }

struct Link {
  std::string name;
  bool group = false, dataset = false;
};

using Places = std::vector<haddr_t>;  // of groups in the file

Places with(Places places, hid_t group) {
  H5O_info_t info{};
  if (H5Oget_info2(group, &info, H5O_INFO_BASIC) >= 0) places.push_back(info.addr);
  return places;
}

// The links of a group that lie in the file, ascending by name. None may lead to a group of `above`: the walk would not
// end.
std::vector<Link> linksOf(hid_t group, Budget& budget, RecordPipe& pipe, const Places& above = {}) {
  struct Found {
    std::vector<Link> links;
    Budget& budget;
    RecordPipe& pipe;
    const Places& above;
    bool circular = false;
  };
  const auto visit = [](hid_t parent, const char* name, const H5L_info_t* info, void* to) -> herr_t {
    auto& found = *static_cast<Found*>(to);
    if (found.budget.links == 0) return 1;
    --found.budget.links;
    found.pipe.alive();
    if (info->type == H5L_TYPE_EXTERNAL) return 0;
    H5O_info_t object{};
    if (H5Oget_info_by_name2(parent, name, &object, H5O_INFO_BASIC, H5P_DEFAULT) < 0) return 0;
    const bool is_group = object.type == H5O_TYPE_GROUP;
    found.circular = is_group && std::find(found.above.begin(), found.above.end(), object.addr) != found.above.end();
    if (found.circular) return 1;
    found.links.push_back({name, is_group, object.type == H5O_TYPE_DATASET});
    return 0;
  };
  Found found{{}, budget, pipe, above};
  hsize_t at = 0;
  if (H5Literate(group, H5_INDEX_NAME, H5_ITER_NATIVE, &at, visit, &found) < 0)
    throw Failure("a group of the file cannot be listed");
  if (found.circular) throw Failure("has groups that contain themselves");
  if (budget.links == 0) throw Failure("has more than " + std::to_string(kMostLinks) + " groups and arrays");
  std::sort(found.links.begin(), found.links.end(), [](const Link& a, const Link& b) { return a.name < b.name; });
  return std::move(found.links);
}

bool has(const std::vector<Link>& links, const std::string& name, bool dataset) {
  return std::any_of(links.begin(), links.end(),
                     [&](const Link& link) { return link.name == name && (dataset ? link.dataset : link.group); });
}

Handle openGroup(hid_t parent, const std::string& name, const std::string& what) {
  Handle group(H5Gopen2(parent, name.c_str(), H5P_DEFAULT), H5Gclose);
  if (!group.good()) throw Failure("holds no " + what);
  return group;
}

// A dataset whose bytes lie in the file and may be read.
class Dataset {
 public:
  Dataset(hid_t parent, const std::string& name, Budget& budget)
      : name_(name), set_(H5Dopen2(parent, name.c_str(), H5P_DEFAULT), H5Dclose), type_(-1, H5Tclose) {
    if (!set_.good()) throw Failure(inQuotes(name_) + " cannot be opened");
    const Handle plist(H5Dget_create_plist(set_), H5Pclose);
    if (!plist.good() || H5Pget_layout(plist) == H5D_VIRTUAL || H5Pget_external_count(plist) != 0)
      throw Failure(inQuotes(name_) + " refers to other files, which are not read");
    const Handle space(H5Dget_space(set_), H5Sclose);
    const int rank = space.good() ? H5Sget_simple_extent_ndims(space) : -1;
    if (rank < 1 || rank > 4) throw Failure(inQuotes(name_) + " is not an array");
    dims_.resize(static_cast<std::size_t>(rank));
    if (H5Sget_simple_extent_dims(space, dims_.data(), nullptr) < 0) throw Failure(inQuotes(name_) + " has no extent");
    type_ = Handle(H5Dget_type(set_), H5Tclose);
    if (!type_.good()) throw Failure(inQuotes(name_) + " has no type");
    std::uint64_t claimed = std::max<std::uint64_t>(1, H5Tget_size(type_));
    for (const hsize_t dim : dims_) {
      if (dim != 0 && claimed > budget.bytes / dim)
        throw Failure(inQuotes(name_) + " claims " + std::to_string(dims_[0]) +
                      " rows, more than the bytes of the file can hold");
      claimed *= dim;
    }
    budget.bytes -= claimed;
  }

  std::uint64_t rows() const { return dims_[0]; }
  std::uint64_t width() const {
    std::uint64_t width = 1;
    for (std::size_t i = 1; i < dims_.size(); ++i) width *= dims_[i];
    return width;
  }
  std::optional<ColumnType> type() const {
    switch (H5Tget_class(type_)) {
      case H5T_FLOAT:
        return ColumnType::real;
      case H5T_INTEGER:
      case H5T_ENUM:
        return ColumnType::integer;
      case H5T_STRING:
        return ColumnType::text;
      default:
        return std::nullopt;
    }
  }

  // Values of 8 bytes, little-endian: f64 for reals, i64 for integers.
  std::vector<unsigned char> numbers(ColumnType as) const {
    std::vector<unsigned char> bytes(rows() * width() * 8);
    if (bytes.empty()) return bytes;
    if (H5Tget_class(type_) == H5T_ENUM) {  // enumerations such as h5py's booleans: the values behind the names
      const Handle base(H5Tget_super(type_), H5Tclose);
      const std::size_t size = base.good() ? H5Tget_size(base) : 0;
      if (size == 0 || size > 8) throw Failure(inQuotes(name_) + " has an enumeration of an unknown kind");
      if (H5Dread(set_, type_, H5S_ALL, H5S_ALL, H5P_DEFAULT, bytes.data()) < 0) fail();
      if (H5Tconvert(base, H5T_STD_I64LE, rows() * width(), bytes.data(), nullptr, H5P_DEFAULT) < 0) fail();
      return bytes;
    }
    const hid_t memory = as == ColumnType::real ? H5T_IEEE_F64LE : H5T_STD_I64LE;
    if (H5Dread(set_, memory, H5S_ALL, H5S_ALL, H5P_DEFAULT, bytes.data()) < 0) fail();
    return bytes;
  }

  std::vector<std::string> texts() const {
    const std::uint64_t count = rows() * width();
    std::vector<std::string> texts;
    texts.reserve(count);
    if (count == 0) return texts;
    const Handle memory(H5Tcopy(type_), H5Tclose);
    if (H5Tis_variable_str(type_) > 0) {
      std::vector<char*> pointers(count, nullptr);
      if (H5Dread(set_, memory, H5S_ALL, H5S_ALL, H5P_DEFAULT, pointers.data()) < 0) fail();
      for (char* const text : pointers) {
        texts.emplace_back(text == nullptr ? "" : text);
        std::free(text);  // NOLINT: the library's default allocator
      }
      return texts;
    }
    const std::size_t size = H5Tget_size(type_);
    std::vector<char> bytes(count * size);
    if (H5Dread(set_, memory, H5S_ALL, H5S_ALL, H5P_DEFAULT, bytes.data()) < 0) fail();
    const bool blanks = H5Tget_strpad(type_) == H5T_STR_SPACEPAD;
    for (std::uint64_t i = 0; i < count; ++i) {
      std::string text(bytes.data() + i * size, strnlen(bytes.data() + i * size, size));
      while (blanks && !text.empty() && text.back() == ' ') text.pop_back();
      texts.push_back(std::move(text));
    }
    return texts;
  }

 private:
  [[noreturn]] void fail() const { throw Failure(inQuotes(name_) + " cannot be read: the file is damaged"); }

  std::string name_;
  Handle set_, type_;
  std::vector<hsize_t> dims_;
};

std::string columnHead(std::int64_t group, const std::string& name, ColumnType type, std::uint64_t width,
                       std::uint64_t rows) {
  std::string head;
  RecordPipe::putU64(head, static_cast<std::uint64_t>(group));
  RecordPipe::putU32(head, static_cast<std::uint32_t>(type));
  RecordPipe::putU32(head, static_cast<std::uint32_t>(width));
  RecordPipe::putU64(head, rows);
  return head + name;
}

void sendTexts(const std::vector<std::string>& texts, RecordKind kind, RecordPipe& pipe) {
  std::string batch;
  for (const std::string& text : texts) {
    RecordPipe::putText(batch, text.substr(0, kMostTextBytes));
    if (batch.size() > (std::size_t{1} << 20)) pipe.send(kind, std::exchange(batch, {}));
  }
  if (!batch.empty()) pipe.send(kind, batch);
}

// Sends the attributes of one group of nodes, or of the population itself.
class Columns {
 public:
  Columns(RecordPipe& pipe, Budget& budget, std::int64_t group) : pipe_(pipe), budget_(budget), group_(group) {}

  void sendGroup(hid_t group, const std::string& prefix, int depth, const Places& outer = {}) {
    const Places above = with(outer, group);
    const std::vector<Link> links = linksOf(group, budget_, pipe_, above);
    std::set<std::string> coded;
    if (prefix.empty() && has(links, "@library", false))
      for (const Link& link : linksOf(openGroup(group, "@library", "@library"), budget_, pipe_))
        if (link.dataset) coded.insert(link.name);
    for (const Link& link : links) {
      if (link.name == "@library" && link.group) continue;
      if (link.group && depth < kMostDepth) {
        sendGroup(openGroup(group, link.name, "group " + inQuotes(link.name)), prefix + link.name + "/", depth + 1,
                  above);
      } else if (link.dataset) {
        sendDataset(group, link.name, prefix + link.name, coded.count(link.name) > 0);
      }
    }
  }

  void sendDataset(hid_t parent, const std::string& link, const std::string& name, bool coded) {
    const Dataset set(parent, link, budget_);
    const std::optional<ColumnType> type = set.type();
    if (!type || set.width() > 16) {
      skip(name, !type ? "its type is neither number nor text" : "it has more than 16 values in a row");
      return;
    }
    if (coded) {
      if (*type != ColumnType::integer || set.width() != 1)
        throw Failure(inQuotes(name) + " has a @library, so it must be an array of integers");
      sendCoded(set, Dataset(openGroup(parent, "@library", "@library"), link, budget_), name);
      return;
    }
    pipe_.send(RecordKind::column, columnHead(group_, name, *type, set.width(), set.rows()));
    if (*type == ColumnType::text) {
      sendTexts(set.texts(), RecordKind::values, pipe_);
    } else {
      const auto bytes = set.numbers(*type);
      pipe_.sendAll(RecordKind::values, bytes.data(), bytes.size(), 8);
    }
  }

 private:
  void skip(const std::string& name, const std::string& why) {
    std::string payload;
    RecordPipe::putText(payload, name);
    RecordPipe::putText(payload, why);
    pipe_.send(RecordKind::skipped, payload);
  }

  void sendCoded(const Dataset& places, const Dataset& library, const std::string& name) {
    if (library.type() != ColumnType::text) {
      skip(name, "its @library holds no text");
      return;
    }
    const std::vector<std::string> texts = library.texts();
    const auto bytes = places.numbers(ColumnType::integer);
    std::vector<std::string> values;
    values.reserve(places.rows());
    for (std::uint64_t i = 0; i < places.rows(); ++i) {
      std::uint64_t at = 0;
      for (int k = 7; k >= 0; --k) at = at << 8 | bytes[i * 8 + static_cast<std::size_t>(k)];
      if (at >= texts.size())
        throw Failure(inQuotes(name) + " of node " + std::to_string(i) + " is entry " +
                      std::to_string(static_cast<std::int64_t>(at)) + " of a @library of " +
                      std::to_string(texts.size()));
      values.push_back(texts[at]);
    }
    pipe_.send(RecordKind::column, columnHead(group_, name, ColumnType::text, 1, places.rows()));
    sendTexts(values, RecordKind::values, pipe_);
  }

  RecordPipe& pipe_;
  Budget& budget_;
  std::int64_t group_;
};

void findMorphologies(hid_t group, const std::string& prefix, int depth, Budget& budget, RecordPipe& pipe,
                      std::vector<std::string>& names, const Places& outer = {}) {
  const Places above = with(outer, group);
  for (const Link& link : linksOf(group, budget, pipe, above)) {
    if (!link.group) continue;
    const Handle inner(H5Gopen2(group, link.name.c_str(), H5P_DEFAULT), H5Gclose);
    if (!inner.good()) continue;
    const std::vector<Link> links = linksOf(inner, budget, pipe);
    if (has(links, "points", true) && has(links, "structure", true))
      names.push_back(prefix + link.name);
    else if (depth < kMostDepth)
      findMorphologies(inner, prefix + link.name + "/", depth + 1, budget, pipe, names, above);
  }
}

std::optional<std::int64_t> groupNumber(const std::string& name) {
  if (name.empty() || name.size() > 9 ||
      !std::all_of(name.begin(), name.end(), [](unsigned char c) { return std::isdigit(c) != 0; }))
    return std::nullopt;
  return std::stoll(name);
}

}  // namespace

void FileReader::prepare() {
  H5Eset_auto2(H5E_DEFAULT, nullptr, nullptr);
  H5PLset_loading_state(0);
}

FileReader::FileReader(const std::string& path) : file_(-1) {
  std::error_code error;
  const std::uint64_t bytes = std::filesystem::file_size(path, error);
  if (error) throw Failure(error.message());
  budget_.bytes = std::min(bytes, UINT64_MAX / kMostPacked - 1) * kMostPacked + kUnpackedSlack;
  const Handle access(H5Pcreate(H5P_FILE_ACCESS), H5Pclose);
  std::string name = path;
  // The file has no name: /proc/PID/fd/N stands for it. H5Fopen would follow this link to the name that the file had.
  if (path.starts_with("/proc/")) {
    std::string image(bytes, '\0');
    std::ifstream in(path, std::ios::binary);
    if (!in.read(image.data(), static_cast<std::streamsize>(bytes))) throw Failure("cannot be read");
    H5Pset_fapl_core(access, std::size_t{1} << 20, 0);
    H5Pset_file_image(access, image.data(), image.size());
    name += "/image";  // an image must have a name that no file has
  }
  file_ = H5Fopen(name.c_str(), H5F_ACC_RDONLY, access);
  if (file_ < 0) throw Failure("not an HDF5 file, or a damaged one");
}

FileReader::~FileReader() {
  if (file_ >= 0) H5Fclose(file_);
}

void FileReader::morphologies(RecordPipe& pipe) {
  const std::vector<Link> links = linksOf(file_, budget_, pipe);
  std::vector<std::string> names;
  if (has(links, "points", true) && has(links, "structure", true))
    names.emplace_back();
  else
    findMorphologies(file_, "", 0, budget_, pipe, names);
  if (names.empty() && has(links, "neuron1", false))
    throw Failure(
        "is an H5 morphology of version 2; filiform reads version 1, which MorphIO's `morph-tool convert` writes");
  sendTexts(names, RecordKind::names, pipe);
}

void FileReader::morphology(const std::string& name, RecordPipe& pipe) {
  const std::string what = "morphology " + inQuotes(name);
  const Handle group = openGroup(file_, name.empty() ? "/" : name, what);
  const std::vector<Link> links = linksOf(group, budget_, pipe);
  for (const char* const part : {"points", "structure"})
    if (!has(links, part, true)) throw Failure("has no '" + std::string(part) + "': not an H5 morphology of version 1");
  const Dataset points(group, "points", budget_), structure(group, "structure", budget_);
  if ((points.type() != ColumnType::real && points.type() != ColumnType::integer) || points.width() != 4)
    throw Failure("'points' is not an array of N x 4 numbers");
  if (structure.type() != ColumnType::integer || structure.width() != 3)
    throw Failure("'structure' is not an array of N x 3 integers");
  const auto p = points.numbers(ColumnType::real);
  pipe.sendAll(RecordKind::points, p.data(), p.size(), 32);
  const auto s = structure.numbers(ColumnType::integer);
  pipe.sendAll(RecordKind::structure, s.data(), s.size(), 24);
}

void FileReader::populations(RecordPipe& pipe) {
  std::vector<std::string> names;
  const Handle nodes = openGroup(file_, "nodes", "'/nodes': not a SONATA file of nodes");
  for (const Link& link : linksOf(nodes, budget_, pipe))
    if (link.group) names.push_back(link.name);
  sendTexts(names, RecordKind::names, pipe);
}

void FileReader::population(const std::string& name, RecordPipe& pipe) {
  const Handle nodes = openGroup(file_, "nodes", "'/nodes': not a SONATA file of nodes");
  const Handle population = openGroup(nodes, name, "population " + inQuotes(name));
  Columns own(pipe, budget_, -1);
  std::map<std::int64_t, std::string> groups;
  for (const Link& link : linksOf(population, budget_, pipe)) {
    if (link.dataset) own.sendDataset(population, link.name, link.name, false);
    if (!link.group) continue;
    if (const auto number = groupNumber(link.name)) groups.emplace(*number, link.name);
  }
  for (const auto& [number, link] : groups)
    Columns(pipe, budget_, number).sendGroup(openGroup(population, link, "group " + inQuotes(link)), "", 0);
}

}  // namespace filiform::hdf5
