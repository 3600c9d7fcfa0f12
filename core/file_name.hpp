#pragma once

#include <string>
#include <string_view>

namespace hairnet {

// A path's last part: "Curls.HAIR" of "a/Curls.HAIR".
inline std::string_view file_name_of(std::string_view path) {
  return path.substr(path.find_last_of('/') + 1);
}

// Where the extension begins in the name of a file; its length without one, as in ".hair".
inline std::size_t extension_begin(std::string_view name) {
  const std::size_t dot = name.rfind('.');
  return dot == 0 || dot == std::string_view::npos ? name.size() : dot;
}

// The extension in small letters: ".hair" of "a/Curls.HAIR".
inline std::string extension_of(std::string_view path) {
  const std::string_view name = file_name_of(path);
  std::string extension(name.substr(extension_begin(name)));
  for (char& letter : extension) {
    if (letter >= 'A' && letter <= 'Z') letter = static_cast<char>(letter - 'A' + 'a');
  }
  return extension;
}

// The name without the extension: "Curls" of "a/Curls.HAIR".
inline std::string_view stem_of(std::string_view path) {
  const std::string_view name = file_name_of(path);
  return name.substr(0, extension_begin(name));
}

}  // namespace hairnet
