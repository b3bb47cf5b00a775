# The Debian packages, one a component, made by CPack. tools/package/README.md lists what each holds.
set(data "${CMAKE_CURRENT_LIST_DIR}/data")
if(NOT TARGET filiform_described OR NOT TARGET filiform-lab)
  message(FATAL_ERROR "The Debian packages need Python 3, which writes the man pages, and filiform-lab")
endif()

install(FILES "${data}/filiform.desktop" DESTINATION "${CMAKE_INSTALL_DATADIR}/applications" COMPONENT program)
install(FILES "${data}/filiform.svg" DESTINATION "${CMAKE_INSTALL_DATADIR}/icons/hicolor/scalable/apps" COMPONENT program)
install(FILES "${data}/filiform.metainfo.xml" DESTINATION "${CMAKE_INSTALL_DATADIR}/metainfo" COMPONENT program)
install(FILES "${data}/filiform-swc.xml" DESTINATION "${CMAKE_INSTALL_DATADIR}/mime/packages" COMPONENT program)
install(DIRECTORY "${PROJECT_SOURCE_DIR}/tools/examples/" DESTINATION "${CMAKE_INSTALL_DOCDIR}-dev/examples" COMPONENT development)

set(CPACK_GENERATOR DEB)
set(CPACK_PACKAGE_NAME filiform)
string(REPLACE "-" "~" CPACK_PACKAGE_VERSION "${FILIFORM_VERSION}")  # "~" sorts before the release
set(CPACK_PACKAGE_CONTACT "filiform developers <filiform@filiform.invalid>")
set(CPACK_PACKAGING_INSTALL_PREFIX /usr)
set(CPACK_STRIP_FILES ON)
set(CPACK_DEB_COMPONENT_INSTALL ON)
set(CPACK_COMPONENTS_GROUPING IGNORE)
set(CPACK_DEBIAN_FILE_NAME DEB-DEFAULT)
set(CPACK_DEBIAN_PACKAGE_SECTION science)
set(CPACK_DEBIAN_PACKAGE_SHLIBDEPS ON)
set(CPACK_INSTALL_DEFAULT_DIRECTORY_PERMISSIONS OWNER_READ OWNER_WRITE OWNER_EXECUTE GROUP_READ GROUP_EXECUTE WORLD_READ WORLD_EXECUTE)
set(CPACK_COMPONENTS_ALL program lab library development)

set(program filiform)
set(lab filiform-lab)
set(library libfiliform0)
set(development libfiliform-dev)
set(python python3-filiform)
set(web filiform-web)
if(TARGET filiform_python_core)
  list(APPEND CPACK_COMPONENTS_ALL python)
endif()
# The preset `web` builds the page, for every architecture.
set(page "${PROJECT_SOURCE_DIR}/build/web/page")
if(EXISTS "${page}/filiform.wasm.gz")
  list(APPEND CPACK_COMPONENTS_ALL web)
  install(DIRECTORY "${page}/" DESTINATION "${CMAKE_INSTALL_DATADIR}/filiform/web" COMPONENT web)
endif()

set(about "filiform lets a person travel through whole neuronal columns by hand.
It ingests reconstructions of neurons, cuts them into tiles on disk,
finds the nearest segments exactly, and computes the force on the hand.")
set(CPACK_DEBIAN_PROGRAM_DESCRIPTION "navigation through neuronal columns by hand\n${about}")
set(CPACK_DEBIAN_LAB_DESCRIPTION "benchmarks and evaluation of filiform\n${about}\n\nThis package holds the commands bench and evaluate.")
set(CPACK_DEBIAN_LIBRARY_DESCRIPTION "tile sets of neurons, C library\n${about}\n\nThis package holds the shared library.")
set(CPACK_DEBIAN_DEVELOPMENT_DESCRIPTION "tile sets of neurons, development files\n${about}\n
This package holds the C header, the C++ headers and libraries,\nand examples.")
set(CPACK_DEBIAN_PYTHON_DESCRIPTION "tile sets of neurons, Python module\n${about}\n\nThis package holds the module filiform for Python 3.")
set(CPACK_DEBIAN_WEB_DESCRIPTION "navigation through neuronal columns in a browser\n${about}\n
This package holds the page that filiform serve shows at /travel/.")

set(software_renderer "libegl1, libopengl0, libgl1-mesa-dri")  # opened at run time, for pictures
set(CPACK_DEBIAN_PROGRAM_PACKAGE_RECOMMENDS "${software_renderer}")
set(CPACK_DEBIAN_PYTHON_PACKAGE_RECOMMENDS "filiform, ${software_renderer}")  # filiform: reads HDF5 files
set(CPACK_DEBIAN_PROGRAM_PACKAGE_SUGGESTS "filiform-lab, filiform-web, ffmpeg")
set(CPACK_DEBIAN_LAB_PACKAGE_DEPENDS "filiform (= ${CPACK_PACKAGE_VERSION})")
set(CPACK_DEBIAN_WEB_PACKAGE_ARCHITECTURE all)
set(CPACK_DEBIAN_WEB_PACKAGE_SHLIBDEPS OFF)
set(CPACK_DEBIAN_WEB_PACKAGE_ENHANCES filiform)
set(CPACK_DEBIAN_LIBRARY_PACKAGE_SECTION libs)
set(CPACK_DEBIAN_PACKAGE_GENERATE_SHLIBS ON)
set(CPACK_DEBIAN_LIBRARY_PACKAGE_CONTROL_EXTRA "${data}/triggers")
set(CPACK_DEBIAN_DEVELOPMENT_PACKAGE_SECTION libdevel)
set(CPACK_DEBIAN_DEVELOPMENT_PACKAGE_DEPENDS "libfiliform0 (= ${CPACK_PACKAGE_VERSION})")
# For the C++ libraries, which are static; a C program needs none of them.
set(CPACK_DEBIAN_DEVELOPMENT_PACKAGE_SUGGESTS "libeigen3-dev, libzip-dev, libarchive-dev, libdeflate-dev, zlib1g-dev, libxxhash-dev, libhwy-dev, liblz4-dev, \
libcurl4-openssl-dev, libssl-dev, libpugixml-dev, libusb-1.0-0-dev, libepoxy-dev, libegl-dev, libglfw3-dev, libimgui-dev")
set(CPACK_DEBIAN_PYTHON_PACKAGE_SECTION python)
# A module fits one version of Python: that of the system.
execute_process(COMMAND /usr/bin/python3 -c "import sys; print(f'3.{sys.version_info[1]}, 3.{sys.version_info[1] + 1}')"
  OUTPUT_VARIABLE python_versions OUTPUT_STRIP_TRAILING_WHITESPACE COMMAND_ERROR_IS_FATAL ANY)
string(REGEX REPLACE "(.*), (.*)" "python3 (>= \\1), python3 (<< \\2), python3-numpy" CPACK_DEBIAN_PYTHON_PACKAGE_DEPENDS "${python_versions}")
set(CPACK_DEBIAN_PYTHON_PACKAGE_CONTROL_EXTRA "${data}/python/postinst" "${data}/python/prerm")

find_program(gzip gzip REQUIRED)
foreach(component IN LISTS CPACK_COMPONENTS_ALL)
  string(TOUPPER ${component} upper)
  set(CPACK_DEBIAN_${upper}_PACKAGE_NAME ${${component}})
  # Each package has a changelog of its own name.
  set(package_name ${${component}})
  set(folder "${PROJECT_BINARY_DIR}/package-documents/${package_name}")
  configure_file("${data}/changelog.in" "${folder}/changelog" @ONLY)
  execute_process(COMMAND "${gzip}" -9nf "${folder}/changelog" COMMAND_ERROR_IS_FATAL ANY)
  install(FILES "${folder}/changelog.gz" "${data}/copyright" DESTINATION "share/doc/${package_name}" COMPONENT ${component})
endforeach()
include(CPack)
