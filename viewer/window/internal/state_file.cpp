#include "viewer/window/internal/state_file.h"

#include "index/errors.h"
#include "index/output.h"

#include <atomic>

#include <nlohmann/json.hpp>

namespace filiform::internal {

bool StateFile::write(const nlohmann::ordered_json& state) {
  if (!isOn()) return false;
  static const std::atomic<bool> kDoNotWait{true};  // for the reader of a pipe
  try {
    Output out(path_, {.sync = false, .cancel = &kDoNotWait});
    out.stream() << state.dump(1, ' ', false, nlohmann::json::error_handler_t::replace) << '\n';
    out.finish();
    failure_.clear();
  } catch (const Interrupted&) {  // a pipe without a reader
  } catch (const ClosedPipe&) {
  } catch (const Error& error) {
    const bool is_first = failure_.empty();
    failure_ = error.what();
    return is_first;
  }
  return false;
}

}  // namespace filiform::internal
