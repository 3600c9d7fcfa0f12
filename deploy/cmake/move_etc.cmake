# Runs over each component's staged files before they are packed.
cmake_policy(VERSION 3.25)
file(GLOB staged "${CPACK_TEMPORARY_DIRECTORY}/*/usr/etc")
foreach(etc IN LISTS staged)
  get_filename_component(usr "${etc}" DIRECTORY)
  get_filename_component(root "${usr}" DIRECTORY)
  file(RENAME "${etc}" "${root}/etc")
endforeach()
