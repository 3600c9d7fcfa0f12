# clang 16 with Debian 12's C and C++ libraries for WebAssembly: deploy/setup wasm.
set(CMAKE_SYSTEM_NAME Generic)
set(CMAKE_SYSTEM_PROCESSOR wasm32)
set(CMAKE_CXX_COMPILER clang++-16)
set(CMAKE_CXX_COMPILER_TARGET wasm32-wasi)
set(CMAKE_AR llvm-ar-16)
set(CMAKE_RANLIB llvm-ranlib-16)
# A program needs functions that the module does not export.
set(CMAKE_TRY_COMPILE_TARGET_TYPE STATIC_LIBRARY)
