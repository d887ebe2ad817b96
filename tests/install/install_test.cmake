# Fails when a step fails: install, configure the stranger, build it, run it.
file(REMOVE_RECURSE ${SCRATCH})

function(run)
  execute_process(COMMAND ${ARGN} RESULT_VARIABLE code OUTPUT_VARIABLE output
                  ERROR_VARIABLE output)
  if(NOT code EQUAL 0)
    message(FATAL_ERROR "${ARGN}: exit code ${code}\n${output}")
  endif()
  set(output "${output}" PARENT_SCOPE)
endfunction()

set(prefix ${SCRATCH}/prefix)
run(${CMAKE_COMMAND} --install ${BUILD} --prefix ${prefix})
if(EXISTS ${prefix}/include/surfseg/libsurf/volume/openvdb_grid.h)
  message(FATAL_ERROR "a private header was installed")
endif()
if(HAS_PROGRAM)
  run(${prefix}/bin/surfseg --version)
  if(NOT output STREQUAL "surfseg ${VERSION}\n")
    message(FATAL_ERROR "the installed program says: ${output}")
  endif()
  run(${prefix}/bin/surfseg segment --preset list)
  if(NOT output MATCHES "kidney-ct  ")
    message(FATAL_ERROR "the installed program knows these presets: ${output}")
  endif()
endif()

# The tree itself must not be needed: the stranger is a copy outside of it.
file(COPY ${STRANGER} DESTINATION ${SCRATCH})
run(${CMAKE_COMMAND} -G Ninja -S ${SCRATCH}/stranger -B ${SCRATCH}/build
    -DCMAKE_BUILD_TYPE=Release -DCMAKE_PREFIX_PATH=${prefix})
run(${CMAKE_COMMAND} --build ${SCRATCH}/build)
run(${SCRATCH}/build/stranger)
if(NOT output MATCHES "closed, manifold")
  message(FATAL_ERROR "the stranger says: ${output}")
endif()
run(${SCRATCH}/build/plane_stranger)
file(REMOVE_RECURSE ${SCRATCH})
