# Options, the build type's default, and two INTERFACE targets every own target
# links: surfseg_compile (language level, floating point) and surfseg_warnings.
if(CMAKE_SOURCE_DIR STREQUAL PROJECT_SOURCE_DIR)
  set(SURFSEG_TOP_LEVEL ON)
else()
  set(SURFSEG_TOP_LEVEL OFF)
endif()

option(SURFSEG_BUILD_TOOLS "Build the command line programs" ON)
option(SURFSEG_BUILD_TESTS "Build the tests and benchmarks" ${SURFSEG_TOP_LEVEL})
option(SURFSEG_WERROR "Treat warnings as errors (for developers)" OFF)
option(SURFSEG_NATIVE "Optimise for this machine's processor; results may differ elsewhere" OFF)
set(SURFSEG_SANITIZE "" CACHE STRING "Sanitizers, as in -fsanitize=: address,undefined or thread")
option(SURFSEG_FUZZ "Build the readers and their libFuzzer programs only; needs clang" OFF)
option(BUILD_SHARED_LIBS "Build shared libraries" ON)

if(SURFSEG_TOP_LEVEL AND NOT CMAKE_BUILD_TYPE AND NOT CMAKE_CONFIGURATION_TYPES)
  set(CMAKE_BUILD_TYPE Release CACHE STRING "Build type" FORCE)
endif()

find_program(SURFSEG_CCACHE ccache)
mark_as_advanced(SURFSEG_CCACHE)
if(SURFSEG_TOP_LEVEL AND SURFSEG_CCACHE)
  set(CMAKE_CXX_COMPILER_LAUNCHER ${SURFSEG_CCACHE})
  set(CMAKE_C_COMPILER_LAUNCHER ${SURFSEG_CCACHE})
endif()

add_library(surfseg_compile INTERFACE)
target_compile_features(surfseg_compile INTERFACE cxx_std_20)
# No contraction to fused multiply-adds: results must repeat on every machine.
target_compile_options(surfseg_compile INTERFACE -ffp-contract=off)
if(SURFSEG_FUZZ OR NOT BUILD_SHARED_LIBS)
  target_compile_definitions(surfseg_compile INTERFACE SURFSEG_STATIC)  # libsurf/base/detail/late_library.h
endif()
if(SURFSEG_NATIVE)
  target_compile_options(surfseg_compile INTERFACE -march=native)
endif()
if(SURFSEG_SANITIZE)
  target_compile_options(surfseg_compile INTERFACE -fsanitize=${SURFSEG_SANITIZE}
                         -fno-omit-frame-pointer -fno-sanitize-recover=all)
  target_link_options(surfseg_compile INTERFACE -fsanitize=${SURFSEG_SANITIZE})
  if(SURFSEG_SANITIZE MATCHES "address")  # its runtime, which Python has to load first (tests/python)
    set(SURFSEG_ASAN_RUNTIME libasan.so)
    if(CMAKE_CXX_COMPILER_ID MATCHES "Clang")
      set(SURFSEG_ASAN_RUNTIME libclang_rt.asan-${CMAKE_SYSTEM_PROCESSOR}.so)
    endif()
    execute_process(COMMAND ${CMAKE_CXX_COMPILER} -print-file-name=${SURFSEG_ASAN_RUNTIME}
                    OUTPUT_VARIABLE SURFSEG_ASAN_RUNTIME OUTPUT_STRIP_TRAILING_WHITESPACE)
    if(CMAKE_CXX_COMPILER_ID MATCHES "Clang")
      # vptr asks for type information that Debian's libraries hide.
      target_compile_options(surfseg_compile INTERFACE -fno-sanitize=vptr
                             -fsanitize-ignorelist=${PROJECT_SOURCE_DIR}/tests/ubsan.ignore)
      get_filename_component(asan_folder "${SURFSEG_ASAN_RUNTIME}" DIRECTORY)
      target_link_options(surfseg_compile INTERFACE -shared-libasan -Wl,-rpath,${asan_folder})
    endif()
  endif()
  if(SURFSEG_SANITIZE MATCHES "thread")
    # tools/tsan-tbb.sh's TBB, for our programs and what they load alone: as an environment it would reach Python's modules.
    target_link_options(surfseg_compile INTERFACE -Wl,--disable-new-dtags,-rpath,${PROJECT_SOURCE_DIR}/build/tsan-tbb/lib)
  endif()
endif()

add_library(surfseg_warnings INTERFACE)
target_compile_options(surfseg_warnings INTERFACE -Wall -Wextra -Wshadow -Wnon-virtual-dtor
                       -Woverloaded-virtual $<$<BOOL:${SURFSEG_WERROR}>:-Werror>)
