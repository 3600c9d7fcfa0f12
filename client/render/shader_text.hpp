#pragma once

#include <string_view>

namespace hairnet::render {

// The text of a file of client/shaders at the time of the build, with its includes; empty for an unknown name. Programs
// carry the text, so they find their shaders wherever they are installed.
std::string_view shader_text(std::string_view file);

}  // namespace hairnet::render
