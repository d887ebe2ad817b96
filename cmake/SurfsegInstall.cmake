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

  # Headers that are shared between sources only, some of which show OpenVDB.
  set(SURFSEG_PRIVATE_HEADERS
      assemble.h box_tree.h byte_stream.h curve_setting.h dicom_structure.h edge_offset.h
      exact_segments.h ladder.h model.h openvdb_grid.h raster.h raw_scalars.h read_dicom.h
      reconnection.h read_metaimage.h read_nifti.h read_nrrd.h read_vdb.h read_vti.h region_search.h region_terms.h
      rung_features.h seed_model.h slice_stack.h spline.h surface_formats.h surface_setting.h sweep_status.h
      vtp_file.h winding_rays.h)
  set(excluded "")
  foreach(header ${SURFSEG_PRIVATE_HEADERS})
    list(APPEND excluded PATTERN ${header} EXCLUDE)
  endforeach()
  install(DIRECTORY ${PROJECT_SOURCE_DIR}/libsurf ${PROJECT_SOURCE_DIR}/libcurve
          DESTINATION ${CMAKE_INSTALL_INCLUDEDIR}/surfseg
          FILES_MATCHING PATTERN "*.h" ${excluded})
endif()

if(SURFSEG_BUILD_TOOLS)
  include(SurfsegManPages)
endif()
