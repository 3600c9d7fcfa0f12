# cmake -DOUT=shader_text.cpp -DSHADERS="a;b" -P embed_shaders.cmake
# Makes a C++ source with the text of each shader. An #include "file" is replaced by the text of that file, which lies
# beside the shader. A file that is included may not include others.
set(entries "")
foreach(path IN LISTS SHADERS)
  get_filename_component(file "${path}" NAME)
  get_filename_component(folder "${path}" DIRECTORY)
  file(READ "${path}" text)
  string(REGEX MATCHALL "#include \"[a-z_]+\\.glsl\"" includes "${text}")
  foreach(include IN LISTS includes)
    string(REGEX REPLACE "#include \"(.*)\"" "\\1" name "${include}")
    file(READ "${folder}/${name}" included)
    string(FIND "${included}" "#include" nested)
    if(NOT nested EQUAL -1)
      message(FATAL_ERROR "${name}, which ${file} includes, may not include others")
    endif()
    string(REPLACE "${include}" "${included}" text "${text}")
  endforeach()
  string(APPEND entries "  if (file == \"${file}\") return R\"glsl(${text})glsl\";\n")
endforeach()
file(WRITE "${OUT}" "#include \"client/render/shader_text.hpp\"

namespace hairnet::render {

std::string_view shader_text(std::string_view file) {
${entries}  return {};
}

}  // namespace hairnet::render
")
