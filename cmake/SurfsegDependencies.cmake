# Every library from outside, found once, as imported targets. tools/setup.sh
# installs the Debian 12 packages; docs/developer.md says what each is for.
find_package(Threads REQUIRED)
find_package(Eigen3 3.4 REQUIRED NO_MODULE)
find_package(TBB REQUIRED)
find_package(OpenMesh REQUIRED)
# Ceres before OpenVDB, or the two definitions of TBB's targets clash (Debian 12).
find_package(Ceres REQUIRED)
find_path(SURFSEG_OPENVDB_MODULES FindOpenVDB.cmake
          PATH_SUFFIXES lib/${CMAKE_LIBRARY_ARCHITECTURE}/cmake/OpenVDB lib/cmake/OpenVDB REQUIRED)
mark_as_advanced(SURFSEG_OPENVDB_MODULES)
list(APPEND CMAKE_MODULE_PATH ${SURFSEG_OPENVDB_MODULES})
find_package(OpenVDB REQUIRED)
set(CGAL_DO_NOT_WARN_ABOUT_CMAKE_BUILD_TYPE TRUE)
find_package(CGAL 5.5 REQUIRED)
find_package(MPI REQUIRED COMPONENTS C)  # wanted by VTK's own package file
set(SURFSEG_VTK CommonCore CommonDataModel FiltersCore IOXML metaio RenderingCore RenderingOpenGL2)
if(SURFSEG_BUILD_TESTS)
  list(APPEND SURFSEG_VTK FiltersGeometry IOGeometry IOImage)  # readers and writers that are not ours
endif()
find_package(VTK 9.1 REQUIRED COMPONENTS ${SURFSEG_VTK})
find_package(X11 REQUIRED)  # to look for a display before VTK does
find_package(fmt REQUIRED)
find_package(nlohmann_json 3.11 REQUIRED)
find_package(ZLIB REQUIRED)
find_package(OpenSSL REQUIRED COMPONENTS Crypto)
find_package(PNG REQUIRED)
find_package(JPEG REQUIRED)
find_package(TIFF REQUIRED)
# Only the two structs of the file headers (libnifti2-dev).
find_path(SURFSEG_NIFTI_INCLUDE nifti/nifti2.h REQUIRED)
mark_as_advanced(SURFSEG_NIFTI_INCLUDE)

# Least cuts; a template, so headers only.
find_path(SURFSEG_MAXFLOW_INCLUDE maxflow/graph.cpp PATH_SUFFIXES maxflow-3.0 REQUIRED)
mark_as_advanced(SURFSEG_MAXFLOW_INCLUDE)
add_library(surfseg_maxflow INTERFACE IMPORTED)
target_include_directories(surfseg_maxflow SYSTEM INTERFACE ${SURFSEG_MAXFLOW_INCLUDE})

# Libraries without a usable package file become imported targets here.
function(surfseg_find_library target header library)
  cmake_parse_arguments(ARG "" "" "PATH_SUFFIXES" ${ARGN})
  string(MAKE_C_IDENTIFIER ${target} id)
  find_path(${id}_INCLUDE ${header} PATH_SUFFIXES ${ARG_PATH_SUFFIXES} REQUIRED)
  find_library(${id}_LIBRARY ${library} REQUIRED)
  mark_as_advanced(${id}_INCLUDE ${id}_LIBRARY)
  add_library(${target} UNKNOWN IMPORTED)
  set_target_properties(${target} PROPERTIES IMPORTED_LOCATION ${${id}_LIBRARY}
                        INTERFACE_INCLUDE_DIRECTORIES ${${id}_INCLUDE})
endfunction()
surfseg_find_library(surfseg_cholmod cholmod.h cholmod PATH_SUFFIXES suitesparse)
# Before Ceres in what is linked, or the BLAS of whatever Ceres was built with comes first.
surfseg_find_library(surfseg_openblas cblas-openblas.h openblas)
surfseg_find_library(surfseg_blosc blosc.h blosc)
surfseg_find_library(surfseg_teem teem/nrrd.h teem)
# GDCM's package file also exports its VTK bridge, which wants packages that are not needed here.
surfseg_find_library(surfseg_gdcm gdcmReader.h gdcmMSFF PATH_SUFFIXES gdcm-3.0)
foreach(part DSED DICT Common)
  find_library(SURFSEG_GDCM_${part} gdcm${part} REQUIRED)
  mark_as_advanced(SURFSEG_GDCM_${part})
  set_property(TARGET surfseg_gdcm APPEND PROPERTY INTERFACE_LINK_LIBRARIES ${SURFSEG_GDCM_${part}})
endforeach()

# DICOM Segmentation and Encapsulated STL. Optional: without it they are refused with one line.
find_package(DCMTK 3.6.7 CONFIG QUIET)
if(DCMTK_FOUND)
  add_library(surfseg_dcmtk INTERFACE IMPORTED)
  target_link_libraries(surfseg_dcmtk INTERFACE DCMTK::dcmseg DCMTK::dcmfg DCMTK::dcmiod
                        DCMTK::dcmdata DCMTK::oflog DCMTK::ofstd)
endif()

if(SURFSEG_BUILD_TOOLS OR SURFSEG_BUILD_TESTS)
  find_package(CLI11 REQUIRED)
endif()
if(SURFSEG_BUILD_TESTS)
  find_package(GTest REQUIRED)
  find_package(benchmark REQUIRED)
endif()

# The interpreter of the tests and the Python module: Debian's own first, another one on the path
# lacks its modules. Optional.
find_program(SURFSEG_PYTHON NAMES /usr/bin/python3 python3)
