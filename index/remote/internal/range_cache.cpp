#include "index/remote/internal/range_cache.h"

#include "index/errors.h"
#include "index/file/internal/bytes.h"
#include "index/file/internal/digest.h"
#include "index/internal/descriptor.h"
#include "index/text.h"

#include <algorithm>
#include <cerrno>
#include <chrono>
#include <cstring>
#include <fcntl.h>
#include <filesystem>
#include <string_view>
#include <sys/file.h>
#include <sys/stat.h>
#include <time.h>
#include <unistd.h>
#include <vector>

namespace filiform::internal {
namespace {

namespace fs = std::filesystem;

constexpr std::string_view kPartMagic = "FILIPART";
constexpr std::string_view kAside = "aside-";
constexpr std::chrono::hours kLeftBehind{1};

// "FILIPART", version u32, length of the key u32, number of bytes u64, checksum u64 (of key and bytes), key, bytes.
constexpr std::size_t kPartHeader = 32;

std::uint64_t partChecksum(std::string_view key, std::span<const std::uint8_t> bytes) {
  RunningDigest digest;
  digest.add(key);
  digest.add(bytes);
  return digest.value();
}

void makeCacheFolder(const std::string& path) {
  std::error_code error;  // mkdir() reports it
  fs::create_directories(fs::path(path).parent_path(), error);
  if (::mkdir(path.c_str(), 0700) == 0 || errno == EEXIST) return;
  throw IoError("--cache " + inShort(path), "cannot make the folder", errno);
}

bool isHexadecimal(std::string_view text) {
  return std::all_of(text.begin(), text.end(), [](char c) { return (c >= '0' && c <= '9') || (c >= 'a' && c <= 'f'); });
}

// "aside-PROCESS-NUMBER"
bool isAside(std::string_view name) {
  if (!name.starts_with(kAside)) return false;
  name.remove_prefix(kAside.size());
  const std::size_t dash = name.find('-');
  return dash != 0 && dash + 1 < name.size() && dash != std::string_view::npos &&
         name.find_first_not_of("0123456789", dash + 1) == std::string_view::npos &&
         name.substr(0, dash).find_first_not_of("0123456789") == std::string_view::npos;
}

struct CachedPart {
  std::string path;
  fs::file_time_type used;
  std::uint64_t bytes;
};

// The parts of a cache. Removes what a crash left behind. Names that put() does not give stay.
std::vector<CachedPart> listParts(const std::string& folder) {
  std::vector<CachedPart> parts;
  const auto old = fs::file_time_type::clock::now() - kLeftBehind;
  std::error_code error;
  for (fs::directory_iterator sub(folder, error), end; !error && sub != end; sub.increment(error)) {
    const std::string sub_name = sub->path().filename().string();
    if (sub_name.size() != 2 || !isHexadecimal(sub_name)) continue;
    std::error_code unread;
    for (fs::directory_iterator at(sub->path(), unread); !unread && at != end; at.increment(unread)) {
      const std::string name = at->path().filename().string();
      std::error_code gone;
      const fs::file_time_type used = at->last_write_time(gone);
      const std::uint64_t bytes = gone ? 0 : at->file_size(gone);
      if (gone) continue;
      if (isAside(name)) {
        if (used < old) fs::remove(at->path(), gone);
      } else if (name.size() == 14 && isHexadecimal(name)) {
        parts.push_back({at->path().string(), used, bytes});
      }
    }
  }
  return parts;
}

}  // namespace

RangeCache::RangeCache(const std::string& folder, std::uint64_t most_bytes) : most_bytes_(most_bytes) {
  std::string path = folder;
  while (path.size() > 1 && path.ends_with('/')) path.pop_back();
  makeCacheFolder(path);
  folder_ = path + "/parts-1";
  makeCacheFolder(folder_);
  if (::access(folder_.c_str(), R_OK | W_OK | X_OK) != 0)
    throw IoError("--cache " + inShort(folder), "cannot write into the folder", errno);
}

std::string RangeCache::pathOf(const std::string& key) const {
  const std::string name = hex16(checksum(key));
  return folder_ + "/" + name.substr(0, 2) + "/" + name.substr(2);
}

bool RangeCache::get(const std::string& key, std::span<std::uint8_t> bytes) {
  const std::string path = pathOf(key);
  const Descriptor file(::open(path.c_str(), O_RDONLY | O_CLOEXEC | O_NOFOLLOW));
  if (!file.isOpen()) return false;
  Bytes head(kPartHeader + key.size());
  bool sound = file.read(head.data(), head.size()) == head.size() &&
               std::memcmp(head.data(), kPartMagic.data(), kPartMagic.size()) == 0;
  if (sound) {
    ByteReader in(ByteSpan(head).subspan(kPartMagic.size()));
    sound = in.u32() == 1 && in.u32() == key.size() && in.u64() == bytes.size();
    const std::uint64_t stated = in.u64();
    sound = sound && std::memcmp(head.data() + kPartHeader, key.data(), key.size()) == 0 &&
            file.read(bytes.data(), bytes.size()) == bytes.size() && partChecksum(key, bytes) == stated;
  }
  if (!sound) {
    ::unlink(path.c_str());
    return false;
  }
  // Finer than the kernel's time of "now".
  struct timespec now[2] = {{}, {}};
  ::clock_gettime(CLOCK_REALTIME, &now[0]);
  now[1] = now[0];
  ::futimens(file.number(), now);
  return true;
}

void RangeCache::put(const std::string& key, std::span<const std::uint8_t> bytes) {
  const std::uint64_t size = kPartHeader + key.size() + bytes.size();
  if (size > most_bytes_ / 8) return;
  if (added_.fetch_add(size) + size > most_bytes_ / 16) trim();
  const std::string path = pathOf(key);
  const std::string folder = path.substr(0, path.rfind('/'));
  if (::mkdir(folder.c_str(), 0700) != 0 && errno != EEXIST) return;
  const std::string aside =
      folder + "/" + std::string(kAside) + std::to_string(::getpid()) + "-" + std::to_string(serial_++);
  {
    const Descriptor file(::open(aside.c_str(), O_WRONLY | O_CREAT | O_EXCL | O_CLOEXEC | O_NOFOLLOW, 0600));
    if (!file.isOpen()) return;
    ByteWriter head;
    head.text(kPartMagic);
    head.u32(1);
    head.u32(static_cast<std::uint32_t>(key.size()));
    head.u64(bytes.size());
    head.u64(partChecksum(key, bytes));
    head.text(key);
    if (!file.write(head.bytes().data(), head.bytes().size()) || !file.write(bytes.data(), bytes.size())) {
      ::unlink(aside.c_str());
      return;
    }
  }
  if (::rename(aside.c_str(), path.c_str()) != 0) ::unlink(aside.c_str());
}

void RangeCache::remove(const std::string& key) { ::unlink(pathOf(key).c_str()); }

void RangeCache::trim() {
  const std::unique_lock only(trimming_, std::try_to_lock);
  if (!only.owns_lock()) return;
  const Descriptor lock(::open((folder_ + "/lock").c_str(), O_RDWR | O_CREAT | O_CLOEXEC | O_NOFOLLOW, 0600));
  if (!lock.isOpen() || ::flock(lock.number(), LOCK_EX | LOCK_NB) != 0) return;
  added_ = 0;
  std::vector<CachedPart> parts = listParts(folder_);
  std::uint64_t sum = 0;
  for (const CachedPart& part : parts) sum += part.bytes;
  if (sum <= most_bytes_ - most_bytes_ / 4) return;
  std::sort(parts.begin(), parts.end(), [](const CachedPart& a, const CachedPart& b) { return a.used < b.used; });
  for (const CachedPart& part : parts) {
    if (sum <= most_bytes_ - most_bytes_ / 4) break;
    if (::unlink(part.path.c_str()) == 0) sum -= part.bytes;
  }
}

}  // namespace filiform::internal
