#pragma once

#include <cstdint>
#include <span>
#include <string>

namespace hairnet::same_bits {

// Takes the steps of a session by the functions of hairnet.h, as header_session.mjs does by those of a module. `steps`
// are those of session.hpp.
std::string header_results(std::span<const std::uint8_t> steps);

}  // namespace hairnet::same_bits
