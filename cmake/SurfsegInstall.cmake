# cmake --install: libraries, public headers, programs, man pages, and the package that
# find_package(surfseg) reads. tests/install builds a stranger against the result.
include(CMakePackageConfigHelpers)

if(NOT BUILD_SHARED_LIBS)
  message(STATUS "static libraries: the package of find_package(surfseg) is not installed")
else()
  set(SURFSEG_PACKAGE_DIR ${CMAKE_INSTALL_LIBDIR}/cmake/surfseg)
  install(TARGETS surf curve EXPORT surfsegTargets)
  install(EXPORT surfsegTargets NAMESPACE surfseg:: DESTINATION ${SURFSEG_PACKAGE_DIR})
  configure_package_config_file(${PROJECT_SOURCE_DIR}/cmake/surfsegConfig.cmake.in
                                ${CMAKE_BINARY_DIR}/surfsegConfig.cmake
                                INSTALL_DESTINATION ${SURFSEG_PACKAGE_DIR})
  write_basic_package_version_file(${CMAKE_BINARY_DIR}/surfsegConfigVersion.cmake
                                   COMPATIBILITY SameMinorVersion)
  install(FILES ${CMAKE_BINARY_DIR}/surfsegConfig.cmake
                ${CMAKE_BINARY_DIR}/surfsegConfigVersion.cmake
          DESTINATION ${SURFSEG_PACKAGE_DIR})

  # Headers in detail/ and segment/stages/ are shared between sources only; some of them show OpenVDB.
  install(DIRECTORY ${PROJECT_SOURCE_DIR}/libsurf ${PROJECT_SOURCE_DIR}/libcurve
          DESTINATION ${CMAKE_INSTALL_INCLUDEDIR}/surfseg
          FILES_MATCHING PATTERN "*.h" PATTERN detail EXCLUDE PATTERN stages EXCLUDE)
endif()

# Where libsurf/segment/presets.cpp looks for presets; the build folder has them at the same place.
install(DIRECTORY ${PROJECT_SOURCE_DIR}/data/presets DESTINATION share/surfseg
        FILES_MATCHING PATTERN "*.json")
file(MAKE_DIRECTORY ${CMAKE_BINARY_DIR}/share/surfseg)
file(CREATE_LINK ${PROJECT_SOURCE_DIR}/data/presets ${CMAKE_BINARY_DIR}/share/surfseg/presets
     SYMBOLIC)

if(SURFSEG_BUILD_TOOLS)
  set(SURFSEG_OWN_LIBRARIES surf curve)  # a part of the help is theirs; a change of them links no program anew
  include(SurfsegManPages)
  include(SurfsegCompletions)
  install(FILES ${PROJECT_SOURCE_DIR}/packaging/surfseg-studio.desktop DESTINATION share/applications)
  install(FILES ${PROJECT_SOURCE_DIR}/packaging/surfseg-mime.xml DESTINATION share/mime/packages
          RENAME surfseg.xml)
  if(BUILD_SHARED_LIBS AND NOT SURFSEG_SANITIZE)
    include(SurfsegPackage)
  endif()
endif()
