# `cpack` in the build folder makes surfseg_VERSION_ARCHITECTURE.deb: programs, libraries, headers,
# Python module, man pages, completions, presets, the studio's desktop entry.
# tests/package installs it where nothing of ours is.
set(CPACK_GENERATOR DEB)
set(CPACK_PACKAGE_NAME surfseg)
set(CPACK_PACKAGE_VERSION ${PROJECT_VERSION})
# Of who makes the package for others: -D SURFSEG_PACKAGE_CONTACT="Name <address>".
set(SURFSEG_PACKAGE_CONTACT "The surfseg developers <surfseg@example.org>" CACHE STRING
    "Maintainer field of the Debian package")
mark_as_advanced(SURFSEG_PACKAGE_CONTACT)
set(CPACK_PACKAGE_CONTACT ${SURFSEG_PACKAGE_CONTACT})
set(CPACK_PACKAGE_DESCRIPTION_SUMMARY "surfaces from CT and MRI volumes by a click")
set(CPACK_PACKAGE_DESCRIPTION
    "One volume and one point in; out comes a closed, manifold, sub-voxel surface\
 as STL, OBJ, PLY, VTP, GIFTI, glTF, 3MF or DICOM, and contours of slices and images the\
 same way.\n\nWith the programs surfseg, curveseg and surfseg-slicer, a studio in the\
 browser, a module for Python, and the libraries with their headers.")
set(CPACK_PACKAGING_INSTALL_PREFIX /usr)
set(CPACK_STRIP_FILES ON)
set(CPACK_INSTALL_DEFAULT_DIRECTORY_PERMISSIONS
    OWNER_READ OWNER_WRITE OWNER_EXECUTE GROUP_READ GROUP_EXECUTE WORLD_READ WORLD_EXECUTE)
set(CPACK_DEBIAN_FILE_NAME DEB-DEFAULT)
set(CPACK_DEBIAN_PACKAGE_SECTION science)
set(CPACK_DEBIAN_COMPRESSION_TYPE xz)
set(CPACK_DEBIAN_PACKAGE_SHLIBDEPS ON)
set(CPACK_DEBIAN_PACKAGE_SHLIBDEPS_PRIVATE_DIRS ${CMAKE_LIBRARY_OUTPUT_DIRECTORY})
if(TARGET surfseg_python)
  if(NOT DEFINED Python3_EXECUTABLE)
    set(Python3_EXECUTABLE ${SURFSEG_PYTHON})
  endif()
  find_package(Python3 COMPONENTS Interpreter Development.Module QUIET)
  math(EXPR next_minor "${Python3_VERSION_MINOR} + 1")
  set(CPACK_DEBIAN_PACKAGE_DEPENDS
      "python3 (>= ${Python3_VERSION_MAJOR}.${Python3_VERSION_MINOR}), python3 (<< ${Python3_VERSION_MAJOR}.${next_minor}), python3-numpy")
  set(CPACK_DEBIAN_PACKAGE_RECOMMENDS python3-nibabel)
endif()
set(CPACK_DEBIAN_PACKAGE_SUGGESTS "libeigen3-dev, libopenmesh-dev")  # for find_package(surfseg)
set(CPACK_DEBIAN_PACKAGE_GENERATE_SHLIBS ON)
set(CPACK_DEBIAN_PACKAGE_CONTROL_EXTRA ${PROJECT_SOURCE_DIR}/packaging/triggers)
set(CPACK_DEBIAN_PACKAGE_CONTROL_STRICT_PERMISSION ON)
# What Debian asks of a package and `cmake --install` does not need.
set(CPACK_PRE_BUILD_SCRIPTS ${PROJECT_SOURCE_DIR}/packaging/debian-files.cmake)
set(CPACK_SURFSEG_SOURCE ${PROJECT_SOURCE_DIR})
include(CPack)
