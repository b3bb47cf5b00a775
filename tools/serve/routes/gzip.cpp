#include "tools/serve/routes/gzip.h"

#include "tools/serve/sets/timed_store.h"

#include <algorithm>
#include <cstddef>
#include <memory>
#include <string>
#include <utility>
#include <zlib.h>

namespace filiform::tools {

void compress(Answer& answer) {
  constexpr std::size_t kLeast = 1024, kPiece = std::size_t{1} << 20;
  const bool is_text = answer.type.starts_with("text/") || answer.type.find("json") != std::string::npos;
  if (answer.status != 200 || answer.header("ETag").starts_with('"')) return;
  if (!is_text || answer.file || answer.body.size() < kLeast || !answer.header("Content-Encoding").empty()) return;
  z_stream stream{};
  constexpr int kGzip = 16 + 15, kMemory = 8;
  if (::deflateInit2(&stream, Z_BEST_SPEED, Z_DEFLATED, kGzip, kMemory, Z_DEFAULT_STRATEGY) != Z_OK) return;
  const std::unique_ptr<z_stream, int (*)(z_stream*)> ends(&stream, ::deflateEnd);
  std::string packed(::deflateBound(&stream, answer.body.size()), '\0');
  stream.next_in = reinterpret_cast<Bytef*>(answer.body.data());
  stream.next_out = reinterpret_cast<Bytef*>(packed.data());
  stream.avail_out = static_cast<uInt>(packed.size());  // at most 256 MiB
  for (std::size_t left = answer.body.size(); left > 0;) {
    if (TimedStore::isOver()) return;
    const std::size_t piece = std::min(left, kPiece);
    left -= piece;
    stream.avail_in = static_cast<uInt>(piece);
    ::deflate(&stream, left == 0 ? Z_FINISH : Z_NO_FLUSH);
  }
  packed.resize(stream.total_out);
  packed.shrink_to_fit();
  answer.body = std::move(packed);
  answer.headers.emplace_back("Content-Encoding", "gzip");
  if (answer.header("Vary").empty()) answer.headers.emplace_back("Vary", "Accept-Encoding");
}

}  // namespace filiform::tools
