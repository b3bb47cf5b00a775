#include "tools/commands/shared/copy_report.h"

#include "index/text.h"
#include "tools/program/interruption.h"
#include "tools/program/progress.h"
#include "tools/words/numbers.h"

#include <iostream>
#include <utility>

#include <nlohmann/json.hpp>

namespace filiform::tools {

CopyResult copyWithProgress(const char* title, CopyOptions options,
                            const std::function<CopyResult(const CopyOptions& options)>& copy) {
  Progress progress({.title = title, .noun = "", .unit = ProgressUnit::bytes});
  options.remote.cancel = &interruptFlag();
  options.progress = [&](std::uint64_t done, std::uint64_t total) {
    progress.setTotal(total);
    progress.update(done);
  };
  return copy(options);
}

void printCopy(const std::string& there, const char* copied, const CopyResult& r, bool as_json) {
  if (as_json) {
    nlohmann::ordered_json json;
    json["revision"] = r.revision;
    json["before"] = nullptr;
    if (!r.before.empty()) json["before"] = r.before;
    json["files"] = r.files;
    json["bytes"] = r.bytes;
    json["copied"] = r.copied;
    json["copied_bytes"] = r.copied_bytes;
    json["requests"] = r.counters.requests;
    json["retries"] = r.counters.retries;
    std::cout << json.dump() << '\n';
    return;
  }
  std::cout << escaped(there) << ": " << r.revision << ": " << counted(r.files, "file") << ", " << formatBytes(r.bytes)
            << "; " << formatCount(r.copied) << ' ' << copied << ", " << formatBytes(r.copied_bytes);
  if (r.copied < r.files) std::cout << "; the others were there";
  std::cout << '\n';
}

}  // namespace filiform::tools
