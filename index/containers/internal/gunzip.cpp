#include "index/containers/internal/gunzip.h"

#include "index/file/internal/file_parts.h"
#include "index/internal/descriptor.h"

#include <algorithm>
#include <array>
#include <fcntl.h>
#include <memory>
#include <new>
#include <sys/stat.h>
#include <vector>
#include <zlib.h>

namespace filiform::internal {
namespace {

constexpr std::size_t kGzipBlock = std::size_t{1} << 16;

}  // namespace

struct Gunzip::State {
  enum class Where : std::uint8_t { kBeforeFirst, kInside, kBetween, kZeros } where = Where::kBeforeFirst;
  z_stream stream{};
  std::array<char, kGzipBlock> out{};
};

Gunzip::Gunzip() : state_(std::make_unique<State>()) {
  constexpr int kGzipOnly = 16 + MAX_WBITS;
  if (inflateInit2(&state_->stream, kGzipOnly) != Z_OK) throw std::bad_alloc();
}

Gunzip::~Gunzip() { inflateEnd(&state_->stream); }

std::optional<InputCode> Gunzip::feed(std::string_view bytes, const Sink& sink) {
  State& s = *state_;
  using Where = State::Where;
  while (!bytes.empty()) {
    if (s.where == Where::kBetween && bytes.front() == '\0') s.where = Where::kZeros;
    if (s.where == Where::kZeros)
      return bytes.find_first_not_of('\0') == std::string_view::npos ? std::nullopt
                                                                     : std::optional(InputCode::E_ZIP_FORMAT);
    const bool first = s.where == Where::kBeforeFirst;
    s.where = Where::kInside;
    const std::size_t some = std::min(bytes.size(), kGzipBlock);
    s.stream.next_in = reinterpret_cast<Bytef*>(const_cast<char*>(bytes.data()));
    s.stream.avail_in = static_cast<uInt>(some);
    int result = Z_OK;
    do {
      s.stream.next_out = reinterpret_cast<Bytef*>(s.out.data());
      s.stream.avail_out = static_cast<uInt>(s.out.size());
      result = inflate(&s.stream, Z_NO_FLUSH);
      if (result == Z_MEM_ERROR) throw std::bad_alloc();
      if (result != Z_OK && result != Z_STREAM_END && result != Z_BUF_ERROR)
        return first && s.stream.total_out == 0 ? InputCode::E_ZIP_FORMAT : InputCode::E_ZIP_CRC;
      const std::size_t got = s.out.size() - s.stream.avail_out;
      if (got > 0) sink({s.out.data(), got});
    } while (result != Z_STREAM_END && s.stream.avail_out == 0);
    bytes.remove_prefix(some - s.stream.avail_in);
    if (result == Z_STREAM_END) {
      s.where = Where::kBetween;
      inflateReset(&s.stream);
    }
  }
  return std::nullopt;
}

std::optional<InputCode> Gunzip::finish() const {
  using Where = State::Where;
  const bool whole = state_->where == Where::kBetween || state_->where == Where::kZeros;
  return whole ? std::nullopt : std::optional(InputCode::E_ZIP_TRUNCATED);
}

std::optional<InputCode> gunzip(std::string_view bytes, std::uint64_t most, std::string& text) {
  struct TooLong {};
  text.clear();
  Gunzip packed;
  try {
    const std::optional<InputCode> wrong = packed.feed(bytes, [&](std::string_view block) {
      if (block.size() > most - text.size()) throw TooLong();
      text += block;
    });
    return wrong ? wrong : packed.finish();
  } catch (const TooLong&) {
    return InputCode::E_ZIP_SIZE;
  }
}

std::optional<InputCode> gunzipFile(const std::string& path, const Gunzip::Sink& sink,
                                    const std::function<void(std::uint64_t)>& progress) {
  FileParts file(path);
  Gunzip packed;
  std::vector<char> block(kGzipBlock);
  while (const std::size_t n = file.next(block)) {
    if (const auto wrong = packed.feed({block.data(), n}, sink)) return wrong;
    if (progress) progress(n);
  }
  return packed.finish();
}

std::optional<std::uint32_t> statedSize(const std::string& path) {
  const Descriptor file(::open(path.c_str(), O_RDONLY | O_CLOEXEC));
  struct stat status {};
  std::array<unsigned char, 4> size{};
  constexpr off_t kLeast = 18;
  if (!file.isOpen() || ::fstat(file.number(), &status) != 0 || status.st_size < kLeast ||
      file.readAt(static_cast<std::uint64_t>(status.st_size) - 4, size.data(), size.size()) != size.size())
    return std::nullopt;
  return size[0] | std::uint32_t{size[1]} << 8 | std::uint32_t{size[2]} << 16 | std::uint32_t{size[3]} << 24;
}

}  // namespace filiform::internal
