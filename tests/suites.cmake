# filiform_add_suites(TARGET [PROPERTY VALUE]...): one ctest entry for each test suite of a GoogleTest program, so that the
# program starts once a suite. The suites are listed when ctest runs, not when the program is linked.
set(filiform_list_suites "${CMAKE_CURRENT_LIST_DIR}/list_suites.cmake")

function(filiform_add_suites target)
  get_property(emulator TARGET ${target} PROPERTY CROSSCOMPILING_EMULATOR)
  set(list "${CMAKE_CURRENT_BINARY_DIR}/${target}_suites.cmake")
  file(GENERATE OUTPUT "${CMAKE_CURRENT_BINARY_DIR}/${target}_include.cmake" CONTENT "\
set(program \"$<TARGET_FILE:${target}>\")
set(emulator \"${emulator}\")
set(list \"${list}\")
set(properties \"${ARGN}\")
if(NOT EXISTS \"\${program}\")
  add_test(${target}_NOT_BUILT ${target}_NOT_BUILT)
  return()
endif()
if(NOT EXISTS \"\${list}\" OR \"\${program}\" IS_NEWER_THAN \"\${list}\" OR \"${filiform_list_suites}\" IS_NEWER_THAN \"\${list}\")
  include(\"${filiform_list_suites}\")
endif()
include(\"\${list}\")
")
  set_property(DIRECTORY APPEND PROPERTY TEST_INCLUDE_FILES "${CMAKE_CURRENT_BINARY_DIR}/${target}_include.cmake")
endfunction()
