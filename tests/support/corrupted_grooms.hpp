#pragma once

#include <cstdint>
#include <string>
#include <vector>

namespace hairnet::wire {

// A groom file that every decoder must refuse.
struct CorruptedGroom {
  std::string name;
  std::vector<std::uint8_t> file;
  // A part of what the C++ decoder says.
  std::string error;
};

// Whole buffers whose packed stream or whose numbers are wrong, each in one way.
std::vector<CorruptedGroom> corrupted_grooms();

}  // namespace hairnet::wire
