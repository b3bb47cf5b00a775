#include "tools/serve/sets/open_files.h"

#include "index/count_text.h"
#include "index/errors.h"

#include <algorithm>
#include <string>
#include <sys/resource.h>

namespace filiform::tools {

namespace {

constexpr std::size_t kLeastOfSet = 8, kMostOfSet = 512, kOthers = 48;

// A quarter more connections than --max-clients wait for health and readiness.
std::size_t filesOfClients(std::size_t clients) { return clients + clients / 4; }

}  // namespace

std::size_t filesOfSet(std::size_t limit, std::size_t sets, std::size_t clients) {
  const std::size_t free = limit - std::min(limit, filesOfClients(clients) + kOthers);
  if (free >= kLeastOfSet * std::max<std::size_t>(sets, 1))
    return std::min(kMostOfSet, free / std::max<std::size_t>(sets, 1));
  const std::size_t beside = limit - std::min(limit, kLeastOfSet * sets + kOthers);
  throw UsageError(formatCount(sets) + (sets == 1 ? " set and " : " sets and ") + formatCount(clients) +
                   " clients need " + formatCount(kLeastOfSet * sets + filesOfClients(clients) + kOthers) +
                   " open files, and this process may open " + formatCount(limit) + ": " +
                   (beside >= 5 ? "give --max-clients " + std::to_string(beside * 4 / 5)
                                : "serve at most " + formatCount(free / kLeastOfSet) + " sets") +
                   ", or raise the limit (ulimit -Hn, LimitNOFILE of systemd)");
}

std::size_t raiseOpenFiles() {
  struct rlimit limit {};
  if (::getrlimit(RLIMIT_NOFILE, &limit) != 0) return 1024;
  struct rlimit raised = limit;
  raised.rlim_cur = std::min<rlim_t>(limit.rlim_max, 1 << 20);
  if (raised.rlim_cur > limit.rlim_cur && ::setrlimit(RLIMIT_NOFILE, &raised) == 0) limit = raised;
  return static_cast<std::size_t>(std::min<rlim_t>(limit.rlim_cur, 1 << 20));
}

}  // namespace filiform::tools
