#include "client/tools/command_line/end_program.hpp"

#include <cerrno>
#include <cstdio>
#include <cstring>

namespace hairnet {

int end_program(const char* name, int status) {
  errno = 0;
  if (std::fflush(stdout) == 0 && std::ferror(stdout) == 0) return status;
  const char* why = errno == 0 ? "it was not written whole" : std::strerror(errno);
  std::fprintf(stderr, "%s: standard output: %s\n", name, why);
  return status == 0 ? 1 : status;
}

}  // namespace hairnet
