#pragma once

#include <cstdint>
#include <string_view>

namespace hairnet::draw {

// Who sums up the modes of lattices.
enum class NodeSum : std::uint8_t { gpu, processor };

// `renderer`: as OpenGL names it. Software that plays a GPU is slower at this sum than the processor by itself.
NodeSum node_sum_for(std::string_view renderer);

}  // namespace hairnet::draw
