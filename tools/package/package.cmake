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
  DESTINATION "${package_folder}")

# Debian packages: tools/package/make builds them with the preset `package`.
if(FILIFORM_PACKAGE)
  include("${CMAKE_CURRENT_LIST_DIR}/debian.cmake")
endif()
