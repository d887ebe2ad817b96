# `cmake --build BUILD --target docs`: the API reference, BUILD/docs/html/index.html; not part of the default build.
option(SURFSEG_DOCS "The target docs, where Doxygen is installed" ${SURFSEG_TOP_LEVEL})
configure_file(${PROJECT_SOURCE_DIR}/docs/Doxyfile.in ${CMAKE_BINARY_DIR}/docs/Doxyfile @ONLY)
if(SURFSEG_DOCS)
  find_package(Doxygen 1.9.2 QUIET)
  if(DOXYGEN_FOUND)
    add_custom_target(docs COMMAND Doxygen::doxygen ${CMAKE_BINARY_DIR}/docs/Doxyfile
                      COMMENT "Writing the API reference to ${CMAKE_BINARY_DIR}/docs/html" VERBATIM)
  else()
    message(STATUS "Doxygen is missing: no target docs")
  endif()
endif()
