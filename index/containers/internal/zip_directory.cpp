#include "index/containers/internal/zip_directory.h"

#include "index/file/internal/digest.h"
#include "index/file/internal/file_parts.h"
#include "index/text.h"

#include <algorithm>
#include <string_view>
#include <zlib.h>

namespace filiform::internal {
namespace {

using namespace std::string_view_literals;

constexpr std::string_view kLocalMark = "PK\3\4"sv, kEntryMark = "PK\1\2"sv, kEndMark = "PK\5\6"sv;
constexpr std::string_view kEnd64Mark = "PK\6\6"sv, kLocator64Mark = "PK\6\7"sv, kSpanMark = "PK\7\x08"sv;
constexpr std::size_t kLocalBytes = 30, kCentralBytes = 46, kEndBytes = 22, kEnd64Bytes = 56, kLocator64Bytes = 20;
constexpr std::uint64_t kMaxComment = 65535;
constexpr std::uint64_t kMostCentralBytes = kCentralBytes + 3 * std::uint64_t{65535};  // of one entry
constexpr std::uint64_t kMostSignatureBytes = 6 + 65535;
constexpr std::uint64_t kMostParsedTwice = std::uint64_t{16} << 20;

std::uint64_t number(std::string_view bytes, std::size_t at, std::size_t width) {
  std::uint64_t value = 0;
  for (std::size_t i = width; i-- > 0;) value = value << 8 | static_cast<unsigned char>(bytes[at + i]);
  return value;
}

// Requires that the range lies in the file.
std::string bytesAt(const FileParts& file, std::uint64_t at, std::uint64_t count) {
  std::string bytes(static_cast<std::size_t>(count), '\0');
  file.read(at, bytes);
  return bytes;
}

struct EndRecord {
  std::uint64_t entries = 0, bytes = 0, at = 0;  // of the directory, as stated
  std::uint64_t end = 0;                         // where the directory must end: at this record or at the zip64 record
  bool several_disks = false;
};

// The zip64 record is where its locator says. If bytes precede the archive, it is directly before the locator.
bool readEnd64(const FileParts& file, std::uint64_t end_at, EndRecord& record) {
  if (end_at < kLocator64Bytes + kEnd64Bytes) return false;
  const std::uint64_t locator_at = end_at - kLocator64Bytes;
  const std::string locator = bytesAt(file, locator_at, kLocator64Bytes);
  if (locator.compare(0, 4, kLocator64Mark) != 0) return false;
  for (const std::uint64_t at : {number(locator, 8, 8), locator_at - kEnd64Bytes}) {
    if (at > locator_at - kEnd64Bytes) continue;
    const std::string end64 = bytesAt(file, at, kEnd64Bytes);
    if (end64.compare(0, 4, kEnd64Mark) != 0) continue;
    record.several_disks =
        number(end64, 16, 4) != 0 || number(end64, 20, 4) != 0 || number(end64, 24, 8) != number(end64, 32, 8);
    record.entries = number(end64, 32, 8);
    record.bytes = number(end64, 40, 8);
    record.at = number(end64, 48, 8);
    record.end = at;
    return true;
  }
  return false;
}

EndRecord readEnd(const FileParts& file, std::string_view bytes, std::uint64_t end_at) {
  EndRecord record;
  record.several_disks =
      number(bytes, 4, 2) != 0 || number(bytes, 6, 2) != 0 || number(bytes, 8, 2) != number(bytes, 10, 2);
  record.entries = number(bytes, 10, 2);
  record.bytes = number(bytes, 12, 4);
  record.at = number(bytes, 16, 4);
  record.end = end_at;
  if (record.entries == 0xFFFF || record.bytes == 0xFFFFFFFF || record.at == 0xFFFFFFFF)
    readEnd64(file, end_at, record);
  return record;
}

// True if the stated entries can have the stated size. After them only a digital signature of at most 64 KiB may
// follow.
bool plausible(const EndRecord& record) {
  return record.entries <= record.bytes / kCentralBytes &&
         record.bytes / kMostCentralBytes <= record.entries + kMostSignatureBytes / kMostCentralBytes + 1;
}

// Reads values from the zip64 extra field that do not fit the fixed fields. Returns false if that field is missing.
bool readExtra64(std::string_view extra, ZipEntry& entry) {
  std::uint64_t* const values[] = {&entry.bytes, &entry.packed_bytes, &entry.header_at};
  if (std::none_of(std::begin(values), std::end(values), [](const auto* value) { return *value == 0xFFFFFFFF; }))
    return true;
  while (extra.size() >= 4) {
    const std::uint64_t id = number(extra, 0, 2), length = number(extra, 2, 2);
    if (extra.size() < 4 + length) return false;
    if (id == 1) {
      std::size_t at = 4;
      for (std::uint64_t* const value : values) {
        if (*value != 0xFFFFFFFF) continue;
        if (at + 8 > 4 + length) return false;
        *value = number(extra, at, 8);
        at += 8;
      }
      return true;
    }
    extra.remove_prefix(4 + length);
  }
  return false;
}

// The name in the extra field Info-ZIP Unicode Path, which counts if it holds the checksum of the raw name, as libzip
// reads it.
std::string unicodeName(std::string_view extra, std::string_view raw_name) {
  constexpr std::uint64_t kUnicodePath = 0x7075;
  constexpr std::size_t kHeadBytes = 9;  // id, length, version, checksum
  while (extra.size() >= 4) {
    const std::uint64_t id = number(extra, 0, 2), length = number(extra, 2, 2);
    if (extra.size() < 4 + length) break;
    if (id == kUnicodePath && 4 + length > kHeadBytes && extra[4] == 1 &&
        number(extra, 5, 4) ==
            crc32(0, reinterpret_cast<const Bytef*>(raw_name.data()), static_cast<uInt>(raw_name.size()))) {
      const std::string_view name = extra.substr(kHeadBytes, 4 + length - kHeadBytes);
      if (isUtf8(name)) return std::string(name);
    }
    extra.remove_prefix(4 + length);
  }
  return std::string(raw_name);
}

// Reads a stated directory in windows, since a damaged record may state gigabytes.
class CentralDirectoryReader {
 public:
  CentralDirectoryReader(const FileParts& file, std::uint64_t at, std::uint64_t bytes)
      : file_(file), at_(at), left_(bytes) {}
  // The next bytes: at least `count`, or all if fewer are left.
  std::string_view peek(std::size_t count) {
    if (window_.size() - from_ < count && left_ > 0) {
      window_.erase(0, from_);
      from_ = 0;
      const std::uint64_t n = std::min<std::uint64_t>(left_, std::max(kWindow, count));
      window_ += bytesAt(file_, at_, n);
      at_ += n;
      left_ -= n;
    }
    return std::string_view(window_).substr(from_);
  }
  // Requires count <= peek().size().
  void skip(std::size_t count) {
    digest_.add(std::string_view(window_).substr(from_, count));
    from_ += count;
  }
  std::uint64_t digestOfAll() {
    for (std::string_view rest; !(rest = peek(1)).empty();) skip(rest.size());
    return digest_.value();
  }

 private:
  static constexpr std::size_t kWindow = std::size_t{1} << 18;
  const FileParts& file_;
  std::uint64_t at_, left_;
  std::string window_;
  std::size_t from_ = 0;
  RunningDigest digest_;
};

bool parseEntries(CentralDirectoryReader& directory, std::uint64_t count, std::vector<ZipEntry>& entries) {
  entries.clear();
  for (std::string_view bytes;
       entries.size() < count && (bytes = directory.peek(kCentralBytes)).size() >= kCentralBytes;) {
    if (bytes.substr(0, 4) != kEntryMark) return false;
    ZipEntry entry;
    entry.flags = static_cast<std::uint16_t>(number(bytes, 8, 2));
    entry.method = static_cast<std::uint16_t>(number(bytes, 10, 2));
    entry.crc32 = static_cast<std::uint32_t>(number(bytes, 16, 4));
    entry.packed_bytes = number(bytes, 20, 4);
    entry.bytes = number(bytes, 24, 4);
    const std::size_t name = number(bytes, 28, 2), extra = number(bytes, 30, 2), comment = number(bytes, 32, 2);
    entry.attributes = static_cast<std::uint32_t>(number(bytes, 38, 4));
    entry.header_at = number(bytes, 42, 4);
    const std::size_t whole = kCentralBytes + name + extra + comment;
    bytes = directory.peek(whole);
    if (bytes.size() < whole) return false;
    entry.name = unicodeName(bytes.substr(kCentralBytes + name, extra), bytes.substr(kCentralBytes, name));
    entry.name_bytes = static_cast<std::uint16_t>(name);
    if (!readExtra64(bytes.substr(kCentralBytes + name, extra), entry)) return false;
    entries.push_back(std::move(entry));
    directory.skip(whole);
  }
  // Only a digital signature may follow the entries, never another entry.
  return entries.size() == count && directory.peek(4).substr(0, 4) != kEntryMark;
}

// True if entries overlap each other or the directory. An entry has at least a header, a name and packed data.
bool entriesOverlap(const std::vector<ZipEntry>& entries, std::uint64_t directory_at) {
  std::vector<std::pair<std::uint64_t, std::uint64_t>> extents;
  extents.reserve(entries.size());
  for (const ZipEntry& entry : entries) {
    const std::uint64_t overhead = kLocalBytes + entry.name_bytes;
    if (entry.header_at > directory_at || entry.packed_bytes > directory_at ||
        entry.header_at + overhead + entry.packed_bytes > directory_at) {
      return true;
    }
    extents.emplace_back(entry.header_at, entry.header_at + overhead + entry.packed_bytes);
  }
  std::sort(extents.begin(), extents.end());
  for (std::size_t i = 1; i < extents.size(); ++i) {
    if (extents[i].first < extents[i - 1].second) return true;
  }
  return false;
}

}  // namespace

ZipDirectory readZipDirectory(const std::string& path) {
  const FileParts file(path);
  ZipDirectory found;
  const std::uint64_t size = found.file_bytes = file.size();
  const std::uint64_t tail_bytes = std::min(size, kMaxComment + kEndBytes);
  const std::uint64_t tail_at = size - tail_bytes;
  const std::string tail = bytesAt(file, tail_at, tail_bytes);

  bool bytes_missing = false, end_seen = false, have = false;
  std::vector<ZipEntry> entries;
  std::uint64_t parsed = 0;  // bytes of directories read so far
  for (std::size_t at = tail.rfind(kEndMark); at != std::string::npos;
       at = at == 0 ? std::string::npos : tail.rfind(kEndMark, at - 1)) {
    if (tail.size() - at < kEndBytes || number(tail, at + 20, 2) > tail.size() - at - kEndBytes) {
      bytes_missing = true;
      continue;
    }
    const EndRecord record = readEnd(file, std::string_view(tail).substr(at, kEndBytes), tail_at + at);
    end_seen = true;
    if (record.bytes > record.end || record.at > record.end - record.bytes) {
      bytes_missing = true;
      continue;
    }
    const std::uint64_t directory_at = record.end - record.bytes;
    const bool shifted = directory_at != record.at;
    // Of several valid directories, the one at its stated position is used: the others lie inside a comment.
    if (record.several_disks || (shifted && have)) continue;
    if (!plausible(record)) continue;
    // Only an archive made to waste time states so many directories.
    if ((parsed += record.bytes) > 4 * size + kMostParsedTwice) break;
    CentralDirectoryReader directory(file, directory_at, record.bytes);
    if (!parseEntries(directory, record.entries, entries)) continue;
    found.entries = std::move(entries);
    found.archive_at = directory_at - record.at;
    found.digest = directory.digestOfAll();
    have = true;
    if (entriesOverlap(found.entries, record.at)) {
      found.refusal = InputCode::E_ZIP_OVERLAP;
    } else {
      found.refusal.reset();
    }
    if (!shifted) break;
  }
  if (!have) {
    const std::string start = bytesAt(file, 0, std::min<std::uint64_t>(size, 4));
    const auto is_start = [&](std::string_view mark) {
      return start.size() >= 2 && mark.substr(0, start.size()) == start;
    };
    const bool zip_start = is_start(kLocalMark) || is_start(kSpanMark);
    const bool truncated = bytes_missing || (zip_start && !end_seen);
    found.refusal = truncated ? InputCode::E_ZIP_TRUNCATED : InputCode::E_ZIP_FORMAT;
  }
  if (found.refusal) found.entries.clear();
  return found;
}

}  // namespace filiform::internal
