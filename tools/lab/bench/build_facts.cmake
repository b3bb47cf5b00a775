# Writes OUTPUT, what `filiform bench` records of its own build; only when that changed, so that nothing is compiled anew.
execute_process(COMMAND git -C "${SOURCE}" rev-parse --short=12 HEAD OUTPUT_VARIABLE commit OUTPUT_STRIP_TRAILING_WHITESPACE
                RESULT_VARIABLE failed ERROR_QUIET)
if(failed)
  set(commit unknown)
else()
  execute_process(COMMAND git -C "${SOURCE}" status --porcelain --untracked-files=no OUTPUT_VARIABLE changes ERROR_QUIET)
  if(changes)
    string(APPEND commit "+")
  endif()
endif()
string(STRIP "${FLAGS}" flags)
string(REGEX REPLACE " +" " " flags "${flags}")
file(CONFIGURE OUTPUT "${OUTPUT}" @ONLY CONTENT [[
#include "tools/lab/bench/bench_record.h"

namespace filiform::tools {

BuildFacts buildFacts() { return {"@commit@", R"flags(@flags@)flags"}; }

}  // namespace filiform::tools
]])
