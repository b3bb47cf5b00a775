# The package that find_package(filiform) reads: a version file, and what each installed room needs.
include(CMakePackageConfigHelpers)

set(package_folder "${CMAKE_INSTALL_LIBDIR}/cmake/filiform")
set(installed_rooms ${rooms})
list(REMOVE_ITEM installed_rooms tools)
set(modules "")
if(NOT BUILD_SHARED_LIBS)
  foreach(room IN LISTS installed_rooms)
    get_property(room_modules GLOBAL PROPERTY filiform_${room}_modules)
    list(JOIN room_modules " " room_modules)
    string(APPEND modules "set(filiform_${room}_modules ${room_modules})\n")
  endforeach()
endif()
configure_package_config_file(tools/package/filiform-config.cmake.in "${PROJECT_BINARY_DIR}/filiform-config.cmake"
  INSTALL_DESTINATION "${package_folder}")
# A new minor version may change headers before 1.0.
write_basic_package_version_file("${PROJECT_BINARY_DIR}/filiform-config-version.cmake" COMPATIBILITY SameMinorVersion)
install(FILES "${PROJECT_BINARY_DIR}/filiform-config.cmake" "${PROJECT_BINARY_DIR}/filiform-config-version.cmake"
  "${CMAKE_CURRENT_LIST_DIR}/FindImGui.cmake" DESTINATION "${package_folder}")

# Man pages and completion come from the description that the programs give of themselves.
find_package(Python3 COMPONENTS Interpreter)
if(TARGET filiform AND Python3_FOUND AND NOT FILIFORM_SANITIZE AND NOT CMAKE_CROSSCOMPILING)
  set(described "${PROJECT_BINARY_DIR}/described")
  add_custom_command(OUTPUT "${described}/done"
    COMMAND "${CMAKE_COMMAND}" -E rm -rf "${described}"
    COMMAND Python3::Interpreter "${CMAKE_CURRENT_LIST_DIR}/describe" "$<TARGET_FILE:filiform>" "${described}"
    COMMAND "${CMAKE_COMMAND}" -E touch "${described}/done"
    DEPENDS filiform $<TARGET_NAME_IF_EXISTS:filiform-lab> "${CMAKE_CURRENT_LIST_DIR}/describe" VERBATIM)
  add_custom_target(filiform_described ALL DEPENDS "${described}/done")
  install(DIRECTORY "${described}/filiform/" DESTINATION "${CMAKE_INSTALL_DATADIR}" COMPONENT program)
  if(TARGET filiform-lab)
    install(DIRECTORY "${described}/filiform-lab/" DESTINATION "${CMAKE_INSTALL_DATADIR}" COMPONENT lab)
  endif()
endif()

# The Debian packages hold these in folders of their own.
if(NOT FILIFORM_PACKAGE)
  install(FILES "${PROJECT_SOURCE_DIR}/LICENSE" "${PROJECT_SOURCE_DIR}/README.md" "${PROJECT_SOURCE_DIR}/.github/CHANGELOG.md"
    DESTINATION "${CMAKE_INSTALL_DOCDIR}" COMPONENT program OPTIONAL)
  install(DIRECTORY "${PROJECT_SOURCE_DIR}/tools/examples" DESTINATION "${CMAKE_INSTALL_DOCDIR}" COMPONENT development OPTIONAL)
endif()

# Debian packages: tools/package/make builds them with the preset `package`.
if(FILIFORM_PACKAGE)
  include("${CMAKE_CURRENT_LIST_DIR}/debian.cmake")
endif()
