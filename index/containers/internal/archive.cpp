#include "index/containers/internal/archive.h"

#include "index/containers/internal/entry_names.h"
#include "index/containers/internal/zip_directory.h"
#include "index/errors.h"
#include "index/text.h"

#include <algorithm>
#include <cerrno>
#include <libdeflate.h>
#include <string_view>
#include <sys/stat.h>
#include <utility>

#include <zip.h>

namespace filiform {
namespace {

bool isSymbolicLink(const internal::ZipEntry& entry) { return (entry.attributes >> 16 & 0170000) == 0120000; }

InputCode refusalOf(int libzip_error) {
  switch (libzip_error) {
    case ZIP_ER_NOPASSWD:
    case ZIP_ER_WRONGPASSWD:
    case ZIP_ER_ENCRNOTSUPP:
    case ZIP_ER_COMPNOTSUPP:
      return InputCode::E_ZIP_METHOD;
    case ZIP_ER_NOZIP:
    case ZIP_ER_INCONS:
      return InputCode::E_ZIP_FORMAT;
    default:
      return InputCode::E_ZIP_CRC;
  }
}

// Damage in the archive is the entry's fault. A failure of the system stops the run.
void throwIfSystem(const std::string& path, zip_error_t* error) {
  switch (zip_error_code_zip(error)) {
    case ZIP_ER_OPEN:
    case ZIP_ER_NOENT:
    case ZIP_ER_READ:
    case ZIP_ER_SEEK:
    case ZIP_ER_TELL:
      throw IoError(inShort(path), "cannot read the archive", zip_error_code_system(error));
    case ZIP_ER_MEMORY:
      throw std::bad_alloc();
    default:
      return;
  }
}

struct EntryClose {
  void operator()(zip_file_t* file) const { zip_fclose(file); }
};

}  // namespace

// An entry of up to this size is unpacked in one piece by libdeflate, which takes less than half of zlib's time.
constexpr std::uint64_t kMostAtOnce = std::uint64_t{1} << 20;

struct Archive::Reader::Handle {
  explicit Handle(zip_t* opened) : zip(opened), inflater(libdeflate_alloc_decompressor()) {
    if (inflater == nullptr) throw std::bad_alloc();
  }
  Handle(const Handle&) = delete;
  Handle& operator=(const Handle&) = delete;
  ~Handle() {
    zip_discard(zip);
    libdeflate_free_decompressor(inflater);
  }

  // Returns the entry's bytes, or nullopt if they must be read in steps: a large entry, another method, damage.
  std::optional<std::string_view> unpacked(const ArchiveEntry& entry) {
    zip_stat_t stat;
    constexpr zip_uint64_t kNeeded =
        ZIP_STAT_COMP_SIZE | ZIP_STAT_CRC | ZIP_STAT_COMP_METHOD | ZIP_STAT_ENCRYPTION_METHOD;
    if (entry.bytes > kMostAtOnce || zip_stat_index(zip, entry.index, 0, &stat) != 0 ||
        (stat.valid & kNeeded) != kNeeded || stat.comp_method != ZIP_CM_DEFLATE ||
        stat.encryption_method != ZIP_EM_NONE || stat.comp_size > kMostAtOnce)
      return std::nullopt;
    const std::unique_ptr<zip_file_t, EntryClose> file(zip_fopen_index(zip, entry.index, ZIP_FL_COMPRESSED));
    packed.resize(stat.comp_size);
    bytes.resize(entry.bytes);
    if (!file || zip_fread(file.get(), packed.data(), packed.size()) != static_cast<zip_int64_t>(packed.size()) ||
        libdeflate_deflate_decompress(inflater, packed.data(), packed.size(), bytes.data(), bytes.size(), nullptr) !=
            LIBDEFLATE_SUCCESS ||
        libdeflate_crc32(0, bytes.data(), bytes.size()) != stat.crc)
      return std::nullopt;
    return bytes;
  }

  zip_t* zip;
  libdeflate_decompressor* inflater;
  std::string packed, bytes;
};

Archive::Archive(std::string path) : path_(std::move(path)) {
  internal::ZipDirectory directory = internal::readZipDirectory(path_);
  refusal_ = directory.refusal;
  file_bytes_ = directory.file_bytes;
  archive_at_ = directory.archive_at;
  digest_ = directory.digest;
  directory_entries_ = directory.entries.size();
  if (refusal_) return;

  for (std::uint64_t index = 0; index < directory.entries.size(); ++index) {
    const internal::ZipEntry& raw = directory.entries[index];
    std::optional<ArchiveEntry> entry = internal::entryOfName(raw.name, isSymbolicLink(raw));
    if (!entry) continue;
    entry->index = index;
    entry->bytes = raw.bytes;
    entry->packed_bytes = raw.packed_bytes;
    entries_.push_back(std::move(*entry));
  }
  finishListing();
}

std::unique_ptr<Container::Reader> Archive::reader() const { return std::make_unique<Reader>(*this); }

Archive::Reader::Reader(const Archive& archive) : archive_(&archive) {}
Archive::Reader::~Reader() = default;

std::optional<InputCode> Archive::Reader::open() {
  const std::string& path = archive_->path_;
  const std::uint64_t bytes = archive_->file_bytes_;
  struct stat status {};
  if (::stat(path.c_str(), &status) != 0) throw IoError(inShort(path), "cannot open", errno);
  if (static_cast<std::uint64_t>(status.st_size) != bytes)
    throw IoError(inShort(path), "changed while it was being read; run again");
  zip_error_t error;
  zip_error_init(&error);
  zip_source_t* const source = zip_source_file_create(path.c_str(), archive_->archive_at_,
                                                      static_cast<zip_int64_t>(bytes - archive_->archive_at_), &error);
  zip_t* const zip = source == nullptr ? nullptr : zip_open_from_source(source, ZIP_RDONLY, &error);
  if (zip == nullptr) {
    if (source != nullptr) zip_source_free(source);
    throwIfSystem(path, &error);
    return InputCode::E_ZIP_FORMAT;
  }
  handle_ = std::make_unique<Handle>(zip);
  return std::nullopt;
}

std::optional<InputCode> Archive::Reader::read(const ArchiveEntry& entry, const Sink& sink) {
  if (entry.bytes > kMaxEntryBytes) return InputCode::E_ZIP_SIZE;
  if (!handle_)
    if (const std::optional<InputCode> refused = open()) return refused;
  zip_t* const zip = handle_->zip;
  // Both readings of the directory must agree; otherwise the report's names and sizes belong to another file.
  const char* const raw_name = zip_get_name(zip, entry.index, ZIP_FL_ENC_RAW);
  if (static_cast<std::uint64_t>(zip_get_num_entries(zip, 0)) != archive_->directory_entries_ || raw_name == nullptr ||
      entry.name.compare(0, entry.name.find('\0'), raw_name) != 0) {
    return InputCode::E_ZIP_FORMAT;
  }
  if (const std::optional<std::string_view> all = handle_->unpacked(entry)) {
    sink(*all);
    return std::nullopt;
  }
  const std::unique_ptr<zip_file_t, EntryClose> file(zip_fopen_index(zip, entry.index, 0));
  if (!file) {
    throwIfSystem(archive_->path_, zip_get_error(zip));
    return refusalOf(zip_error_code_zip(zip_get_error(zip)));
  }
  constexpr std::uint64_t kBlock = 1 << 16;
  const std::unique_ptr<char[]> block(new char[kBlock]);
  std::uint64_t total = 0;
  for (;;) {
    // One byte more than declared shows an oversized entry. libzip compares the checksum at the end.
    const std::uint64_t left = entry.bytes - total;
    const zip_int64_t got = zip_fread(file.get(), block.get(), std::min(kBlock, left + 1));
    if (got < 0) {
      zip_error_t* const error = zip_file_get_error(file.get());
      throwIfSystem(archive_->path_, error);
      const int code = zip_error_code_zip(error);
      return code == ZIP_ER_INCONS ? InputCode::E_ZIP_SIZE : refusalOf(code);
    }
    if (got == 0) break;
    if (static_cast<std::uint64_t>(got) > left) return InputCode::E_ZIP_SIZE;
    sink({block.get(), static_cast<std::size_t>(got)});
    total += static_cast<std::uint64_t>(got);
  }
  if (total != entry.bytes) return InputCode::E_ZIP_SIZE;
  return std::nullopt;
}

}  // namespace filiform
