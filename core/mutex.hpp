#pragma once

#ifndef __wasm__
#include <mutex>
#endif

namespace hairnet {

// A mutex, and what locks it to the end of a scope. A module for WebAssembly has one thread, and its standard library
// no mutex.
#ifdef __wasm__
class Mutex {};
class MutexLock {
 public:
  explicit MutexLock(Mutex&) {}
};
#else
using Mutex = std::mutex;
using MutexLock = std::lock_guard<std::mutex>;
#endif

}  // namespace hairnet
