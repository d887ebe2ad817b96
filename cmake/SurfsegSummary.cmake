# Printed at the end of configuring, so that one look tells what will be built.
if(SURFSEG_TOP_LEVEL)
  message(STATUS "surfseg ${PROJECT_VERSION}")
  message(STATUS "  build type      ${CMAKE_BUILD_TYPE}")
  message(STATUS "  shared          ${BUILD_SHARED_LIBS}")
  message(STATUS "  programs        ${SURFSEG_BUILD_TOOLS}")
  message(STATUS "  tests           ${SURFSEG_BUILD_TESTS}")
  message(STATUS "  sanitizers      ${SURFSEG_SANITIZE}")
  message(STATUS "  ccache          ${SURFSEG_CCACHE}")
  message(STATUS "  DICOM objects   ${DCMTK_FOUND} (DCMTK ${DCMTK_VERSION})")
  message(STATUS "  VTK ${VTK_VERSION}, CGAL ${CGAL_VERSION}, OpenVDB ${OpenVDB_VERSION}, "
                 "Ceres ${Ceres_VERSION}")
endif()
