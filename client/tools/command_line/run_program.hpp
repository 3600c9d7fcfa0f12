#pragma once

#include <functional>

namespace hairnet {

// Runs a program's main() and returns its exit status. An exception becomes one line and status 1: a damaged file may
// ask for more memory than there is. When its standard output could not be written, to a full disk or a reader that is
// gone, a line says so and a status of 0 becomes 1; else a script would take half an output for the whole.
int run_program(const char* name, const std::function<int()>& run);

}  // namespace hairnet
