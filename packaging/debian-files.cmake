# Run by cpack on the files that it is about to pack: the libraries are on the system's own path, so
# nothing needs a path of its own; man pages and changes are compressed; the licence is where Debian
# looks for it.
set(root ${CPACK_TEMPORARY_INSTALL_DIRECTORY}/usr)
file(GLOB programs ${root}/bin/*)
file(GLOB_RECURSE libraries ${root}/*.so.*.*.* ${root}/_surfseg*.so)  # whatever the folders are
foreach(file ${programs} ${libraries})
  file(RPATH_REMOVE FILE ${file})
endforeach()

set(documents ${root}/share/doc/surfseg)
file(MAKE_DIRECTORY ${documents})
file(COPY ${CPACK_SURFSEG_SOURCE}/CHANGELOG.md ${CPACK_SURFSEG_SOURCE}/README.md
     DESTINATION ${documents} FILE_PERMISSIONS OWNER_READ OWNER_WRITE GROUP_READ WORLD_READ)
file(RENAME ${documents}/CHANGELOG.md ${documents}/changelog)
file(COPY ${CPACK_SURFSEG_SOURCE}/packaging/copyright DESTINATION ${documents}
     FILE_PERMISSIONS OWNER_READ OWNER_WRITE GROUP_READ WORLD_READ)
file(GLOB pages ${root}/share/man/man1/*.1)
execute_process(COMMAND gzip -9n ${documents}/changelog ${pages} COMMAND_ERROR_IS_FATAL ANY)

# Folders that nothing names have the umask's permissions.
file(GLOB_RECURSE entries LIST_DIRECTORIES true ${root}/*)
foreach(entry ${root} ${entries})
  if(IS_DIRECTORY ${entry})
    file(CHMOD ${entry} PERMISSIONS OWNER_READ OWNER_WRITE OWNER_EXECUTE GROUP_READ GROUP_EXECUTE
         WORLD_READ WORLD_EXECUTE)
  endif()
endforeach()
