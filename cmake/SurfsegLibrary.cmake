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
