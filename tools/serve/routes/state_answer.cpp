// The answers about the service and its sets: health, readiness, metrics, sets.
#include "tools/serve/routes/service.h"
#include "tools/words/set_json.h"

namespace filiform::tools {

Answer healthAnswer(const Call&) { return {.type = "text/plain", .body = "ok\n"}; }

Answer readinessAnswer(const Call& call) {
  // Without the lines: this route needs no token, and they name files.
  const std::size_t stale = call.service.shelf.problems().size();
  if (stale > 0) return problem(503, "the newest revision of a set cannot be read; the server's log says which");
  return {.type = "text/plain", .body = "ready\n"};
}

Answer metricsAnswer(const Call& call) {
  return {.type = "text/plain; version=0.0.4", .body = call.service.metrics.text(call.service.shelf)};
}

Answer setsAnswer(const Call& call) {
  nlohmann::ordered_json sets = nlohmann::ordered_json::array();
  for (const auto& served : call.service.shelf.all()) {
    const SetCounts& n = served->set().counts();
    sets.push_back({{"name", served->name()},
                    {"revision", served->set().revision()},
                    {"cells", n.cells},
                    {"segments", n.segments},
                    {"bytes", served->set().bytes()}});
  }
  return jsonAnswer({{"truncated", false}, {"sets", std::move(sets)}});
}

Answer setAnswer(const Call& call) { return jsonAnswer(setJson(call.served->set(), call.served->levels())); }

}  // namespace filiform::tools
