#include "tests/support/zip_builder.h"

#include <fstream>
#include <stdexcept>

#include <zip.h>

namespace filiform::test {
namespace {

std::uint32_t crc32(const std::string& bytes) {
  std::uint32_t crc = 0xFFFFFFFF;
  for (const char c : bytes) {
    crc ^= static_cast<unsigned char>(c);
    for (int bit = 0; bit < 8; ++bit) crc = crc >> 1 ^ (crc & 1 ? 0xEDB88320 : 0);
  }
  return ~crc;
}

void put(std::string& out, std::uint64_t value, int width) {
  for (int i = 0; i < width; ++i) out += static_cast<char>(value >> (8 * i) & 0xFF);
}

// The fields that the local header and the directory share: from the version to the length of the extra field.
void putCommon(std::string& out, const ZipMember& member) {
  put(out, 20, 2);
  put(out, member.flags, 2);
  put(out, member.method, 2);
  put(out, 0x50210000, 4);
  put(out, member.crc32.value_or(crc32(member.content)), 4);
  put(out, member.content.size(), 4);
  put(out, member.bytes.value_or(static_cast<std::uint32_t>(member.content.size())), 4);
  put(out, member.name.size(), 2);
  put(out, member.extra.size(), 2);
}

}  // namespace

std::string unicodePath(const std::string& raw_name, const std::string& name) {
  std::string field = "up";
  put(field, 5 + name.size(), 2);
  put(field, 1, 1);
  put(field, crc32(raw_name), 4);
  return field + name;
}

std::string buildZip(const std::vector<ZipMember>& members, const std::string& comment, const std::string& prefix) {
  std::string out, directory;
  for (const ZipMember& member : members) {
    const std::size_t header_at = out.size();
    out += "PK\3\4";
    putCommon(out, member);
    out += member.name + member.extra + member.content;
    directory += "PK\1\2";
    put(directory, 3 << 8 | 20, 2);
    putCommon(directory, member);
    put(directory, 0, 6);
    put(directory, member.attributes, 4);
    put(directory, member.header_at.value_or(static_cast<std::uint32_t>(header_at)), 4);
    directory += member.name + member.extra;
  }
  const std::size_t directory_at = out.size();
  out += directory + "PK\5\6";
  put(out, 0, 4);
  put(out, members.size(), 2);
  put(out, members.size(), 2);
  put(out, directory.size(), 4);
  put(out, directory_at, 4);
  put(out, comment.size(), 2);
  return prefix + out + comment;
}

void writeDeflatedZip(const std::string& path, const std::vector<ZipMember>& members) {
  zip_t* const zip = zip_open(path.c_str(), ZIP_CREATE | ZIP_TRUNCATE, nullptr);
  if (zip == nullptr) throw std::runtime_error("cannot make " + path);
  for (const ZipMember& member : members) {
    zip_source_t* const source = zip_source_buffer(zip, member.content.data(), member.content.size(), 0);
    const zip_int64_t index = zip_file_add(zip, member.name.c_str(), source, ZIP_FL_ENC_UTF_8);
    const zip_int32_t method = member.content.size() > 64 ? ZIP_CM_DEFLATE : ZIP_CM_STORE;
    if (index < 0 || zip_set_file_compression(zip, static_cast<zip_uint64_t>(index), method, 6) != 0) {
      throw std::runtime_error("cannot add " + member.name);
    }
  }
  if (zip_close(zip) != 0) throw std::runtime_error("cannot write " + path);
}

}  // namespace filiform::test
