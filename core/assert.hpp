#pragma once

#include <cstdio>
#include <cstdlib>

// Assertions stop the program at a programmer's mistake: the caller's (a precondition), the function's own (a
// postcondition) or the type's (an invariant). Bad input never asserts: it is refused with a reason and counted.
//
// HAIRNET_ASSERT(condition) is on in every build. Its condition costs little beside the function that holds it.
// HAIRNET_VALIDATE(condition) may walk whole arrays. It is on in debug and sanitized builds, where HAIRNET_VALIDATE_ON
// is defined; elsewhere the condition is compiled, but not evaluated.

namespace hairnet {

// Out of line and cold, so that a check costs its function one comparison and one jump.
[[noreturn, gnu::cold, gnu::noinline]] inline void assertion_failed(const char* condition, const char* file, int line,
                                                                    const char* function) noexcept {
  std::fprintf(stderr, "%s:%d: %s: assertion failed: %s\n", file, line, function, condition);
  std::abort();
}

}  // namespace hairnet

#ifdef __wasm__
// The texts of all conditions would make a module, which pages load, larger by a tenth: the place must do.
#define HAIRNET_ASSERT(...) \
  ((__VA_ARGS__) ? static_cast<void>(0) : ::hairnet::assertion_failed("see there", __FILE__, __LINE__, ""))
#else
#define HAIRNET_ASSERT(...) \
  ((__VA_ARGS__) ? static_cast<void>(0) : ::hairnet::assertion_failed(#__VA_ARGS__, __FILE__, __LINE__, __func__))
#endif

#ifdef HAIRNET_VALIDATE_ON
#define HAIRNET_VALIDATE(...) HAIRNET_ASSERT(__VA_ARGS__)
#else
// sizeof compiles the condition without evaluating it, so it cannot rot, and its variables count as used.
#define HAIRNET_VALIDATE(...) static_cast<void>(sizeof((__VA_ARGS__) ? 1 : 0))
#endif
