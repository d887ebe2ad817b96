# surfseg_embed_page(<target> <name> <path>): a page of three files, <path>.html, .css and .js, built into a target as
# what surfseg::<name>::page_files() returns, which its page.h declares.
function(surfseg_embed_page target name path)
  set(PAGE_NAME ${name})
  foreach(part HTML:html STYLE:css SCRIPT:js)
    string(REPLACE ":" ";" part ${part})
    list(GET part 0 variable)
    list(GET part 1 ending)
    file(READ ${path}.${ending} PAGE_${variable})
    set_property(DIRECTORY APPEND PROPERTY CMAKE_CONFIGURE_DEPENDS ${path}.${ending})
  endforeach()
  configure_file(${PROJECT_SOURCE_DIR}/tools/common/page.cpp.in ${CMAKE_CURRENT_BINARY_DIR}/page.cpp @ONLY)
  target_sources(${target} PRIVATE ${CMAKE_CURRENT_BINARY_DIR}/page.cpp)
endfunction()
