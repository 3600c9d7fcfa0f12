#include "client/tools/command_line/run_program.hpp"

#include <cerrno>
#include <cstdio>
#include <cstring>
#include <exception>
#include <new>

namespace hairnet {

int run_program(const char* name, const std::function<int()>& run) {
  int status = 1;
  try {
    status = run();
  } catch (const std::bad_alloc&) {
    std::fprintf(stderr, "%s: out of memory\n", name);
  } catch (const std::exception& thrown) {
    std::fprintf(stderr, "%s: %s\n", name, thrown.what());
  }
  errno = 0;
  // Output is buffered, so a full disk shows only when it is flushed.
  if (std::fflush(stdout) == 0 && std::ferror(stdout) == 0) return status;
  // A write that failed earlier has lost its errno by now.
  const char* error = errno == 0 ? "it was not written whole" : std::strerror(errno);
  std::fprintf(stderr, "%s: standard output: %s\n", name, error);
  return status == 0 ? 1 : status;
}

}  // namespace hairnet
