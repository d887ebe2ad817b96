# Man pages made from the program's --help, so that help and manual have one source.
find_program(SURFSEG_HELP2MAN help2man)
mark_as_advanced(SURFSEG_HELP2MAN)
if(NOT SURFSEG_HELP2MAN)
  message(STATUS "help2man is missing: no man pages")
  return()
endif()

# surfseg_add_man_page(<program> <verb> <name line>): of a program, or of one of its verbs.
set(SURFSEG_MAN_PAGES "")
function(surfseg_add_man_page program verb name)
  string(JOIN "-" page ${program} ${verb})
  set(output ${CMAKE_BINARY_DIR}/man/${page}.1)
  add_custom_command(
    OUTPUT ${output}
    COMMAND ${CMAKE_COMMAND} -E make_directory ${CMAKE_BINARY_DIR}/man
    COMMAND ${PROJECT_SOURCE_DIR}/tools/man/make-page.sh $<TARGET_FILE:${program}>
            ${PROJECT_VERSION} "${verb}" "${name}" ${output}
    DEPENDS ${program} ${SURFSEG_OWN_LIBRARIES} ${PROJECT_SOURCE_DIR}/tools/man/make-page.sh
            ${PROJECT_SOURCE_DIR}/cmake/SurfsegManPages.cmake  # whose list it reads
    COMMENT "Writing man page ${page}.1"
    VERBATIM)
  set(SURFSEG_MAN_PAGES ${SURFSEG_MAN_PAGES} ${output} PARENT_SCOPE)
endfunction()

surfseg_add_man_page(surfseg "" "surfaces from CT and MRI volumes")
surfseg_add_man_page(surfseg info "say what a volume is and where it lies")
surfseg_add_man_page(surfseg segment "grow a surface from seeds in a volume")
surfseg_add_man_page(surfseg replay "repeat what a recipe says, to the byte")
surfseg_add_man_page(surfseg phantom "make a test volume whose surface is known")
surfseg_add_man_page(surfseg evaluate "compare a surface with a reference")
surfseg_add_man_page(surfseg render "draw a surface, alone or over its volume")
surfseg_add_man_page(surfseg batch "segment all scans of a list")
surfseg_add_man_page(surfseg studio "click in a browser, see the surface, mend it")
surfseg_add_man_page(surfseg-slicer "" "a closed surface from points, for 3D Slicer and MITK")
surfseg_add_man_page(curveseg "" "contours from images and slices of volumes")
surfseg_add_man_page(curveseg segment "grow or shrink curves in an image")
surfseg_add_man_page(curveseg replay "repeat what a recipe says, to the byte")
surfseg_add_man_page(curveseg stack "follow contours through a volume")
surfseg_add_man_page(curveseg phantom "make a test image with a known contour")
surfseg_add_man_page(curveseg evaluate "compare contours with a reference")
surfseg_add_man_page(curveseg info "say what an image or slice is")
add_custom_target(surfseg_man ALL DEPENDS ${SURFSEG_MAN_PAGES})
install(FILES ${SURFSEG_MAN_PAGES} DESTINATION ${CMAKE_INSTALL_MANDIR}/man1)
