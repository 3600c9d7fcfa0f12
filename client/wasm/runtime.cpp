// What the compiler may call, and the C++ library for WebAssembly lacks.
#include <cstddef>
#include <cstdlib>

extern "C" {
int __cxa_thread_atexit(void (*)(void*), void*, void*);
void* __cxa_allocate_exception(std::size_t);
[[noreturn]] void __cxa_throw(void*, void*, void (*)(void*));
}

// For variables that live as long as their thread. A module has one thread, which does not end.
int __cxa_thread_atexit(void (*)(void*), void*, void*) {
  return 0;
}

// Nothing catches exceptions here: what throws, as nanoflann does at its caller's mistakes, ends the instance.
void* __cxa_allocate_exception(std::size_t) {
  std::abort();
}
void __cxa_throw(void*, void*, void (*)(void*)) {
  std::abort();
}
