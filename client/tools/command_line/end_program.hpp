#pragma once

namespace hairnet {

// The last call of a program's main(): returns its exit status. When its standard output could not be written, to a
// full disk or a reader that is gone, a line says so and a status of 0 becomes 1.
int end_program(const char* name, int status);

}  // namespace hairnet
