// Compiling this file compiles the headers that a CMakeLists.txt lists for several targets.
