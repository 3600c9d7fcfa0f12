// Compiling this file compiles the headers that tests/CMakeLists.txt lists.
