# Completions for bash and zsh, made from the programs' --help, so that help and shell have one
# source.
set(SURFSEG_COMPLETIONS "")
function(surfseg_add_completions program)
  foreach(shell bash zsh)
    set(output ${CMAKE_BINARY_DIR}/completion/${program}.${shell})
    add_custom_command(
      OUTPUT ${output}
      COMMAND ${CMAKE_COMMAND} -E make_directory ${CMAKE_BINARY_DIR}/completion
      COMMAND ${PROJECT_SOURCE_DIR}/tools/completion/make-completion.sh ${shell}
              $<TARGET_FILE:${program}> ${output}
      DEPENDS ${program} ${SURFSEG_OWN_LIBRARIES} ${PROJECT_SOURCE_DIR}/tools/completion/make-completion.sh
      COMMENT "Writing the completion of ${program} for ${shell}"
      VERBATIM)
    set(SURFSEG_COMPLETIONS ${SURFSEG_COMPLETIONS} ${output})
  endforeach()
  set(SURFSEG_COMPLETIONS ${SURFSEG_COMPLETIONS} PARENT_SCOPE)
  install(FILES ${CMAKE_BINARY_DIR}/completion/${program}.bash
          DESTINATION share/bash-completion/completions RENAME ${program})
  install(FILES ${CMAKE_BINARY_DIR}/completion/${program}.zsh
          DESTINATION share/zsh/vendor-completions RENAME _${program})
endfunction()

surfseg_add_completions(surfseg)
surfseg_add_completions(curveseg)
surfseg_add_completions(surfseg-slicer)
add_custom_target(surfseg_completions ALL DEPENDS ${SURFSEG_COMPLETIONS})
