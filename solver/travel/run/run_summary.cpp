#include "solver/travel/run/run_summary.h"

namespace filiform {

const char* toString(RunOutcome outcome) {
  switch (outcome) {
    case RunOutcome::completed:
      return "completed";
    case RunOutcome::stuck:
      return "stuck";
    case RunOutcome::time_over:
      return "time_over";
    case RunOutcome::interrupted:
      return "interrupted";
    case RunOutcome::failed:
      return "failed";
  }
  return "";
}

}  // namespace filiform
