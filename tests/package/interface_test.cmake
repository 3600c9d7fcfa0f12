# The binary interface that HEADER declares is the one on RECORD, so that programs go on with a newer library. What changes it on purpose
# writes the record anew:
#   cmake -DHEADER=client/hairnet.h -DRECORD=client/c/libhairnet.abi -DSCRATCH=/tmp -DWRITE=ON -P tests/package/interface_test.cmake
cmake_policy(VERSION 3.25)
function(run)
  execute_process(COMMAND ${ARGN} RESULT_VARIABLE status OUTPUT_VARIABLE output ERROR_VARIABLE output)
  if(NOT status EQUAL 0)
    message(FATAL_ERROR "${output}\nThe first lines of ${CMAKE_CURRENT_LIST_FILE} say how to change the record.")
  endif()
endfunction()

# A library of the same functions without anything in them: what its debugging information tells is the header's alone.
file(READ ${HEADER} header)
string(REGEX REPLACE "(HAIRNET_API [^;{]*\\));" "\\1 { __builtin_trap(); }" functions "${header}")
file(WRITE ${SCRATCH}/interface.c "${functions}")
run(cc -std=c99 -g -ffile-prefix-map=${SCRATCH}/= -shared -fPIC -Wl,-soname,libhairnet.so -o ${SCRATCH}/libinterface.so ${SCRATCH}/interface.c)
if(WRITE)
  run(abidw --no-architecture --no-show-locs --no-comp-dir-path --no-corpus-path --no-elf-needed --out-file ${RECORD} ${SCRATCH}/libinterface.so)
else()
  run(abidiff --no-architecture ${RECORD} ${SCRATCH}/libinterface.so)
endif()
