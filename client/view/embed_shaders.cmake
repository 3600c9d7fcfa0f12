# cmake -DOUT=shader_text.cpp -DSHADERS="a;b" -P embed_shaders.cmake
set(entries "")
foreach(path IN LISTS SHADERS)
  get_filename_component(file "${path}" NAME)
  file(READ "${path}" text)
  string(APPEND entries "  if (file == \"${file}\") return R\"glsl(${text})glsl\";\n")
endforeach()
file(WRITE "${OUT}" "#include \"client/view/shader_text.hpp\"

namespace hairnet::view {

std::string_view shader_text(std::string_view file) {
${entries}  return {};
}

}  // namespace hairnet::view
")
