// The clock of the page's threads. While the page is hidden, threads that wait for the next tick sleep, so that a tab
// in the background costs nothing. Thread rule: any thread.
#pragma once

namespace filiform::web {

void setHidden(bool hidden);

}  // namespace filiform::web
