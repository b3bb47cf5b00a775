// The answers about the service and its sets: health, readiness, metrics, sets.
#include "tools/serve/routes/service.h"
#include "tools/words/set_json.h"

#include <algorithm>

namespace filiform::tools {

Answer healthAnswer(const Call&) { return {.type = "text/plain", .body = "ok\n"}; }

Answer readinessAnswer(const Call& call) {
  // Without names: this route needs no token. /metrics has them.
  const std::vector<SetShelf::State> states = call.service.shelf.states();
  const auto count = [&](bool SetShelf::State::*is) {
    return std::count_if(states.begin(), states.end(), [is](const SetShelf::State& state) { return state.*is; });
  };
  const auto open = count(&SetShelf::State::open);
  if (call.service.metrics.draining) return problem(503, "the server ends; ask another one");
  if (open == 0) return problem(503, "no set can be read; the server's log says why");
  return {.type = "text/plain",
          .body = "ready: " + std::to_string(open) + " of " + std::to_string(states.size()) + " sets, " +
                  std::to_string(count(&SetShelf::State::ready)) + " in the newest revision\n"};
}

Answer metricsAnswer(const Call& call) {
  return {.type = "text/plain; version=0.0.4",
          .body = call.service.metrics.text(call.service.shelf, call.service.version, *call.request.person)};
}

Answer setsAnswer(const Call& call) {
  nlohmann::ordered_json sets = nlohmann::ordered_json::array();
  for (const auto& served : call.sets()) {
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
