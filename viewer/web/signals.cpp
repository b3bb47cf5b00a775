// Stands in for what emscripten lacks of signals: a page has none.
#include <csignal>

extern "C" int sigaltstack(const stack_t*, stack_t*) { return -1; }
