// Makes gzip data and tar archives for tests. Thread rule: pure functions.
#pragma once

#include <string>
#include <vector>

namespace filiform::test {

// `content` as one gzip member.
std::string gzipped(const std::string& content);

struct TarMember {
  std::string name;
  std::string content;
  char type = '0';            // '0' file, '1' hard link, '2' symbolic link, '5' folder
  std::string pax_path = {};  // the true name, in an extended header
};

// A ustar archive with its two records of zeros at the end.
std::string buildTar(const std::vector<TarMember>& members);

}  // namespace filiform::test
