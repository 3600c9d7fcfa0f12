# Writes `output`, the source of version.hpp, when `version` or the commit of `source_dir` differs from what it holds.
cmake_policy(VERSION 3.25)
set(commit)
if(EXISTS ${source_dir}/.git)   # not the repository of a folder above
  execute_process(COMMAND git -C ${source_dir} describe --always --dirty --abbrev=8 --exclude=*
                  OUTPUT_VARIABLE commit ERROR_QUIET OUTPUT_STRIP_TRAILING_WHITESPACE)
endif()
set(both "${version}")
if(commit)
  string(APPEND both " (${commit})")
endif()
file(CONFIGURE OUTPUT ${output} CONTENT [[#include "core/version.hpp"

namespace hairnet {

const char* const kVersion = "@version@";
const char* const kVersionAndCommit = "@both@";

}  // namespace hairnet
]] @ONLY)
