# surfseg_add_library(<name> <folders...>): a library of the sources that its folders add, one folder
# per namespace, with what surfseg's libraries have in common.
function(surfseg_add_library name)
  add_library(${name})
  add_library(surfseg::${name} ALIAS ${name})
  foreach(folder ${ARGN})
    add_subdirectory(${folder})
  endforeach()
  set_target_properties(${name} PROPERTIES VERSION ${PROJECT_VERSION} SOVERSION 0
                        EXPORT_NAME ${name} POSITION_INDEPENDENT_CODE ON)
  target_include_directories(${name} PUBLIC
    $<BUILD_INTERFACE:${PROJECT_SOURCE_DIR}>
    $<INSTALL_INTERFACE:${CMAKE_INSTALL_INCLUDEDIR}/surfseg>)
  target_compile_features(${name} PUBLIC cxx_std_20)
  target_link_libraries(${name} PRIVATE $<BUILD_INTERFACE:surfseg_compile>
                                        $<BUILD_INTERFACE:surfseg_warnings>)
endfunction()

# A part of surf that is a library of its own, loaded when it is first needed
# (libsurf/base/detail/late_library.h); in static builds it is linked as the rest is.
#   surfseg_add_late_library(NAME SOURCES ... LIBRARIES ...)
function(surfseg_add_late_library name)
  cmake_parse_arguments(PARSE_ARGV 1 LATE "" "" "SOURCES;LIBRARIES")
  if(NOT BUILD_SHARED_LIBS)
    target_sources(surf PRIVATE ${LATE_SOURCES})
    foreach(library ${LATE_LIBRARIES})
      target_link_libraries(surf PRIVATE $<BUILD_INTERFACE:${library}>)
    endforeach()
    return()
  endif()
  add_library(${name} SHARED ${LATE_SOURCES})
  target_link_libraries(${name} PRIVATE surf ${LATE_LIBRARIES} surfseg_compile surfseg_warnings)
  set_target_properties(${name} PROPERTIES VERSION ${PROJECT_VERSION} SOVERSION 0)
  install(TARGETS ${name} LIBRARY NAMELINK_SKIP)
  set_property(GLOBAL APPEND PROPERTY SURFSEG_LATE_LIBRARIES ${name})
endfunction()

# Builds the late libraries before what loads them.
function(surfseg_needs_late_libraries target)
  get_property(libraries GLOBAL PROPERTY SURFSEG_LATE_LIBRARIES)
  if(libraries)
    add_dependencies(${target} ${libraries})
  endif()
endfunction()
