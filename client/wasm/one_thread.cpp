// The C++ library for WebAssembly lacks this function of variables that live as long as their thread: a module has one,
// which does not end.
extern "C" int __cxa_thread_atexit(void (*)(void*), void*, void*);

int __cxa_thread_atexit(void (*)(void*), void*, void*) {
  return 0;
}
