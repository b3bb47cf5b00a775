# WebAssembly by Debian's emscripten, which has the system libraries built.
set(ENV{NODE_PATH} /usr/share/nodejs)  # where emscripten's scripts find acorn, whichever node runs them
include(/usr/share/emscripten/cmake/Modules/Platform/Emscripten.cmake)
