#pragma once

#include <cstdint>
#include <string_view>

namespace hairnet::draw {

// Who sums up the modes of lattices: the GPU from coefficients, or the processor, which then uploads all nodes.
enum class NodeSum : std::uint8_t { gpu, processor };

// Chooses by the renderer's name, as OpenGL gives it. Software that plays a GPU is slower at this sum than the
// processor by itself. An unknown name counts as a GPU.
NodeSum node_sum_for(std::string_view renderer);

}  // namespace hairnet::draw
