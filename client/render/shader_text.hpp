#pragma once

#include <string_view>

namespace hairnet::render {

// The text of a file of client/shaders at the time of the build; empty for an unknown name.
std::string_view shader_text(std::string_view file);

}  // namespace hairnet::render
