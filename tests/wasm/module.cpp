#include "tests/wasm/same_bits.hpp"

extern "C" const char* same_bits(const std::uint8_t* cases, std::size_t size);

// The results as text, until the next call.
const char* same_bits(const std::uint8_t* cases, std::size_t size) {
  static std::string results;
  results = hairnet::same_bits::results_of({cases, size});
  return results.c_str();
}
