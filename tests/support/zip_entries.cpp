#include "tests/support/zip_entries.h"

#include <gtest/gtest.h>
#include <zip.h>

namespace filiform::test {

std::map<std::string, std::string> entriesOf(const std::string& path) {
  int code = 0;
  zip_t* archive = zip_open(path.c_str(), ZIP_RDONLY | ZIP_CHECKCONS, &code);
  EXPECT_NE(archive, nullptr) << "error " << code;
  std::map<std::string, std::string> out;
  if (archive == nullptr) return out;
  for (zip_int64_t i = 0; i < zip_get_num_entries(archive, 0); ++i) {
    zip_stat_t stat;
    zip_stat_index(archive, static_cast<zip_uint64_t>(i), 0, &stat);
    std::string text(stat.size, '\0');
    zip_file_t* file = zip_fopen_index(archive, static_cast<zip_uint64_t>(i), 0);
    EXPECT_EQ(zip_fread(file, text.data(), text.size()), static_cast<zip_int64_t>(text.size()));
    EXPECT_EQ(zip_fclose(file), 0) << "its checksum";
    out[stat.name] = text;
  }
  zip_close(archive);
  return out;
}

}  // namespace filiform::test
