#include "index/export/zip_writer.h"

#include "index/errors.h"
#include "index/text.h"

#include <algorithm>
#include <cstring>
#include <exception>
#include <filesystem>
#include <optional>
#include <vector>

#include <zip.h>

namespace filiform::tools {

namespace {

// Fixed date 2011-06-21 12:00:00, so that the same texts give the same bytes.
constexpr zip_uint16_t kEntryDosDate = (2011 - 1980) << 9 | 6 << 5 | 21;
constexpr zip_uint16_t kEntryDosTime = 12 << 11;

// Supplies the zip library with one text after the other while the library closes the archive.
class ZipFeed {
 public:
  explicit ZipFeed(const ZipContent& content) : content_(content) {
    readers_.resize(content.entries);
    for (std::size_t i = 0; i < readers_.size(); ++i) readers_[i] = {this, i, 0, {}, {}};
  }

  zip_source_t* source(zip_t* archive, std::size_t index) {
    return zip_source_function(archive, &ZipFeed::callback, &readers_[index]);
  }
  const std::exception_ptr& failure() const { return failure_; }

 private:
  struct Reader {
    ZipFeed* feed;
    std::size_t index;
    std::size_t at;
    std::function<std::string()> next = {};
    std::string part = {};  // `at` is in it
  };

  const std::string& text(std::size_t index) {
    if (held_ == index) return text_;
    held_.reset();
    text_ = content_.text(index);
    held_ = index;
    return text_;
  }

  static zip_int64_t readPart(Reader& reader, char* data, zip_uint64_t length) {
    if (reader.at == reader.part.size()) reader.part = reader.next(), reader.at = 0;
    const auto n = std::min<std::size_t>(length, reader.part.size() - reader.at);
    std::memcpy(data, reader.part.data() + reader.at, n);
    reader.at += n;
    return static_cast<zip_int64_t>(n);
  }

  zip_int64_t answer(Reader& reader, void* data, zip_uint64_t length, zip_source_cmd_t command) {
    switch (command) {
      case ZIP_SOURCE_SUPPORTS:
        return zip_source_make_command_bitmap(ZIP_SOURCE_OPEN, ZIP_SOURCE_READ, ZIP_SOURCE_CLOSE, ZIP_SOURCE_STAT,
                                              ZIP_SOURCE_ERROR, ZIP_SOURCE_FREE, -1);
      case ZIP_SOURCE_OPEN:
        reader.at = 0;
        if (content_.parts)
          reader.next = content_.parts(reader.index), reader.part.clear();
        else
          text(reader.index);
        return 0;
      case ZIP_SOURCE_READ: {
        if (content_.parts) return readPart(reader, static_cast<char*>(data), length);
        const std::string& bytes = text(reader.index);
        const auto n = std::min<std::size_t>(length, bytes.size() - reader.at);
        std::memcpy(data, bytes.data() + reader.at, n);
        reader.at += n;
        // Reported at the end of the text, because the library ignores the result of ZIP_SOURCE_CLOSE.
        if (n == 0 && length > 0 && content_.written) content_.written(bytes.size());
        return static_cast<zip_int64_t>(n);
      }
      case ZIP_SOURCE_CLOSE:
        return 0;
      case ZIP_SOURCE_STAT: {
        auto* stat = static_cast<zip_stat_t*>(data);
        zip_stat_init(stat);
        stat->size = content_.parts ? content_.bytes(reader.index) : text(reader.index).size();
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
    // No exception may pass through a C library.
    try {
      return reader.feed->answer(reader, data, length, command);
    } catch (...) {
      if (!reader.feed->failure_) reader.feed->failure_ = std::current_exception();
      return -1;
    }
  }

  const ZipContent& content_;
  std::vector<Reader> readers_;
  std::optional<std::size_t> held_;
  std::string text_;
  std::exception_ptr failure_;
};

[[noreturn]] void throwZip(const std::string& named, zip_error_t* error) {
  const int system_error = zip_error_system_type(error) == ZIP_ET_SYS ? zip_error_code_system(error) : 0;
  const std::string what = std::string("cannot write the archive: ") + zip_error_strerror(error);
  zip_error_fini(error);
  if (system_error != 0) throw IoError(inShort(named), "cannot write the archive", system_error);
  throw IoError(inShort(named), what);
}

}  // namespace

std::uint64_t writeZip(const std::string& path, const std::string& shown, const ZipContent& content) {
  zip_error_t error;
  zip_error_init(&error);
  zip_source_t* file = zip_source_file_create(path.c_str(), 0, -1, &error);
  if (file == nullptr) throwZip(shown, &error);
  zip_t* archive = zip_open_from_source(file, ZIP_CREATE | ZIP_TRUNCATE, &error);
  if (archive == nullptr) {
    zip_source_free(file);
    throwZip(shown, &error);
  }
  ZipFeed feed(content);
  const auto fail = [&] {
    zip_error_t copy;
    zip_error_init(&copy);
    const zip_error_t* from = zip_get_error(archive);
    zip_error_set(&copy, zip_error_code_zip(from), zip_error_code_system(from));
    zip_discard(archive);
    if (feed.failure()) std::rethrow_exception(feed.failure());
    throwZip(shown, &copy);
  };
  for (std::size_t i = 0; i < content.entries; ++i) {
    zip_source_t* source = feed.source(archive, i);
    const zip_int64_t index =
        source == nullptr ? -1 : zip_file_add(archive, content.name(i).c_str(), source, ZIP_FL_ENC_UTF_8);
    if (index < 0) {
      zip_source_free(source);
      fail();
    }
    const auto at = static_cast<zip_uint64_t>(index);
    // DOS date fields: a time_t would pass through the local time zone.
    if (zip_file_set_dostime(archive, at, kEntryDosTime, kEntryDosDate, 0) != 0 ||
        zip_file_set_external_attributes(archive, at, 0, ZIP_OPSYS_UNIX, 0100644U << 16) != 0 ||
        zip_set_file_compression(archive, at, ZIP_CM_DEFLATE, 4) != 0)
      fail();
  }
  if (zip_close(archive) != 0) fail();
  std::error_code ignored;
  return std::filesystem::file_size(path, ignored);
}

}  // namespace filiform::tools
