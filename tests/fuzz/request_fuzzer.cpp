#include "index/cell/glob.h"
#include "tests/fuzz/fuzz_bytes.h"
#include "tools/serve/routes/point_list.h"
#include "tools/serve/routes/request.h"
#include "tools/words/npy.h"
#include "tools/words/refusal.h"

#include <string>

namespace filiform::fuzz {

namespace {

constexpr std::size_t kMostFuzzPoints = 64;

void requireClientError(const tools::Refusal& refusal) {
  require(refusal.status() >= 400 && refusal.status() < 500, "a wrong request is the client's error");
}

void fuzzTarget(const std::string& text) {
  const std::string shown = tools::redacted(text);
  const std::size_t capability = shown.substr(0, shown.find('?')).find("/~");
  require(capability == std::string::npos || shown.compare(capability, 5, "/~...") == 0, "logs show no capability");
  try {
    tools::Request request;
    request.target = text;
    request.parseTarget();
    require(!request.parts.empty(), "a target has a part");
    for (const auto& [name, value] : request.parameters) {
      matchesGlob(value, name);
      try {
        tools::parseNumbers(name, value, 3);
        request.whole(name, 0, 1000);
      } catch (const tools::Refusal& refusal) {
        requireClientError(refusal);
      }
    }
    const auto token = request.parameter("token");
    const bool plain = text.find('%') == std::string::npos && text.find("token=") == text.rfind("token=");
    if (token && token->size() > 3 && plain)
      require(shown.find("token=" + *token) == std::string::npos, "logs show no token");
  } catch (const tools::Refusal& refusal) {
    requireClientError(refusal);
  }
}

}  // namespace

void fuzzRequest(Input input) {
  const std::string text(asText(input));
  fuzzTarget(text);
  try {
    require(tools::readNpyPoints(text, kMostFuzzPoints).size() <= kMostFuzzPoints, "arrays keep the limit of points");
  } catch (const tools::Refusal& refusal) {
    requireClientError(refusal);
  }
  try {
    require(tools::readPointList(text, kMostFuzzPoints).points.size() <= kMostFuzzPoints,
            "lists keep the limit of points");
  } catch (const tools::Refusal& refusal) {
    requireClientError(refusal);
  }
}

}  // namespace filiform::fuzz
