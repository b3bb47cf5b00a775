#include "tests/support/gzip_bytes.h"

#include <algorithm>
#include <array>
#include <cstdio>
#include <cstring>
#include <stdexcept>
#include <zlib.h>

namespace filiform::test {

std::string gzipped(const std::string& content) {
  z_stream stream{};
  constexpr int kGzip = 16 + MAX_WBITS;
  if (deflateInit2(&stream, 6, Z_DEFLATED, kGzip, 8, Z_DEFAULT_STRATEGY) != Z_OK) throw std::runtime_error("deflate");
  std::string packed(deflateBound(&stream, content.size()) + 32, '\0');
  stream.next_in = reinterpret_cast<Bytef*>(const_cast<char*>(content.data()));
  stream.avail_in = static_cast<uInt>(content.size());
  stream.next_out = reinterpret_cast<Bytef*>(packed.data());
  stream.avail_out = static_cast<uInt>(packed.size());
  const int result = deflate(&stream, Z_FINISH);
  packed.resize(stream.total_out);
  deflateEnd(&stream);
  if (result != Z_STREAM_END) throw std::runtime_error("deflate");
  return packed;
}

namespace {

std::string tarRecord(const std::string& name, std::size_t bytes, char type) {
  std::string record(512, '\0');
  const auto put = [&](std::size_t at, const std::string& text) {
    std::memcpy(record.data() + at, text.data(), text.size());
  };
  std::array<char, 16> octal{};
  put(0, name.substr(0, 100));
  put(100, "0000644");
  put(108, "0000000");
  put(116, "0000000");
  std::snprintf(octal.data(), octal.size(), "%011lo", static_cast<unsigned long>(bytes));
  put(124, octal.data());
  put(136, "00000000000");
  put(148, "        ");
  record[156] = type;
  if (type == '1' || type == '2') put(157, "target.swc");
  put(257, std::string("ustar\00000", 8));
  unsigned sum = 0;
  for (const char c : record) sum += static_cast<unsigned char>(c);
  std::snprintf(octal.data(), octal.size(), "%06o", sum);
  put(148, std::string(octal.data(), 6) + std::string("\0 ", 2));
  return record;
}

std::string padded(const std::string& content) {
  return content + std::string((512 - content.size() % 512) % 512, '\0');
}

}  // namespace

std::string buildTar(const std::vector<TarMember>& members) {
  std::string tar;
  for (const TarMember& m : members) {
    if (!m.pax_path.empty()) {
      const std::string field = " path=" + m.pax_path + "\n";
      std::size_t length = field.size() + 1;
      while (std::to_string(length).size() + field.size() != length) ++length;
      const std::string header = std::to_string(length) + field;
      tar += tarRecord("pax", header.size(), 'x') + padded(header);
    }
    const bool file = m.type == '0';
    tar += tarRecord(m.name, file ? m.content.size() : 0, m.type);
    if (file) tar += padded(m.content);
  }
  return tar + std::string(1024, '\0');
}

}  // namespace filiform::test
