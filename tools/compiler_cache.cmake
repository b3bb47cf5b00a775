# Every build of the project compiles through ccache where it is installed: two clones share what they compile, whatever their
# folders. CCACHE_DISABLE=1 compiles without it, -DCMAKE_CXX_COMPILER_LAUNCHER= too. See the counts with `ccache -s`.
find_program(FILIFORM_CCACHE ccache)
mark_as_advanced(FILIFORM_CCACHE)
if(FILIFORM_CCACHE AND NOT DEFINED CMAKE_CXX_COMPILER_LAUNCHER)
  cmake_path(GET CMAKE_CURRENT_LIST_DIR PARENT_PATH top)
  # Paths below the clone are hashed relative to it. A precompiled header is hashed by its bytes; a header that was just
  # generated or checked out may be used. An old precompiled header would be hashed as a source of the new one.
  set(launcher sh -c [[rm -f "$(expr " $*" : '.* -o \([^ ]*[.]gch\) ')" && exec "$@"]] sh "${CMAKE_COMMAND}" -E env
    "CCACHE_BASEDIR=${top}" CCACHE_NOHASHDIR=1 CCACHE_MAXSIZE=10G CCACHE_DEPEND=1
    CCACHE_SLOPPINESS=pch_defines,time_macros,include_file_mtime,include_file_ctime "${FILIFORM_CCACHE}")
  set(CMAKE_CXX_COMPILER_LAUNCHER ${launcher} CACHE STRING "Started before the compiler")
  set(CMAKE_C_COMPILER_LAUNCHER ${launcher} CACHE STRING "Started before the compiler")
endif()
