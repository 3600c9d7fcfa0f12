#pragma once

#include <bit>
#include <cstdint>
#include <string>
#include <vector>

#include "core/solver/reference_step.hpp"

namespace hairnet::bench {

// FNV-1a over all bits of lattices, a word at a time: the same hash is the same state.
class StateHash {
 public:
  void add(const LatticeState& state) {
    for (const auto* nodes : {&state.displacement, &state.velocity}) {
      for (const Vec3f& v : *nodes) {
        for (int a = 0; a < 3; ++a) add(std::uint64_t{std::bit_cast<std::uint32_t>(v[a])});
      }
    }
  }
  void add(const WorldLattice& lattice) {
    for (const auto* nodes : {&lattice.P, &lattice.P_dot}) {
      for (const Vec3& v : *nodes) {
        for (int a = 0; a < 3; ++a) add(std::bit_cast<std::uint64_t>(v[a]));
      }
    }
  }
  void add(std::uint64_t word) { hash_ = (hash_ ^ word) * 1099511628211ull; }
  [[nodiscard]] std::string text() const {
    std::string digits(16, '0');
    for (std::size_t i = 0; i < digits.size(); ++i) digits[i] = "0123456789abcdef"[hash_ >> (60 - 4 * i) & 15];
    return digits;
  }

 private:
  std::uint64_t hash_ = 14695981039346656037ull;
};

}  // namespace hairnet::bench
