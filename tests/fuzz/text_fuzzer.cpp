#include "index/text.h"
#include "tests/fuzz/fuzz_bytes.h"

namespace filiform::fuzz {

void fuzzText(Input input) {
  const std::string_view text = asText(input);
  for (const std::string& safe : {escaped(text), escaped(text, 7)}) {
    require(isUtf8(safe), "what is printed is UTF-8");
    require(escaped(safe) == safe, "what is safe stays as it is");
    for (std::size_t i = 0; i < safe.size(); ++i) {
      const auto byte = static_cast<unsigned char>(safe[i]);
      require(byte >= 0x20 && byte != 0x7F, "no control bytes");
      require(byte != 0xC2 || static_cast<unsigned char>(safe[i + 1]) >= 0xA0, "no C1 controls");
    }
  }
  endsWithNoCase(text, ".swc");
}

}  // namespace filiform::fuzz
