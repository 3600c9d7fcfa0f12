# Writes what the schemas list as plain C++, at configure time, so that no FlatBuffers type leaves the sources of wire/:
#   schema/enums.hpp          the enums of enums.fbs, their names and `to_string`
#   schema/wire/message.hpp   the members of union Body, declared, and `Message`: one of them, in the union's order
#   codec_generated.h         for wire's sources alone: a `write` and a `read` for each, which those sources define
set(schema_dir ${CMAKE_CURRENT_LIST_DIR})
set_property(DIRECTORY APPEND PROPERTY CMAKE_CONFIGURE_DEPENDS ${schema_dir}/enums.fbs ${schema_dir}/messages.fbs)

# The names between the braces of `text`, as a list.
function(listed_names text out)
  string(REGEX REPLACE ".*{([^}]*)}" "\\1" names "${text}")
  string(REGEX REPLACE "[ \n]" "" names "${names}")
  string(REPLACE "," ";" names "${names}")
  set(${out} ${names} PARENT_SCOPE)
endfunction()

file(READ ${schema_dir}/enums.fbs schema)
string(REGEX REPLACE "//[^\n]*" "" schema "${schema}")
string(REGEX MATCHALL "enum [A-Za-z]+ : ubyte {[^}]*}" enums "${schema}")
set(text)
foreach(enum IN LISTS enums)
  string(REGEX REPLACE "enum ([A-Za-z]+) .*" "\\1" name "${enum}")
  listed_names("${enum}" values)
  list(LENGTH values count)
  list(GET values -1 last)
  list(JOIN values ", " commas)
  list(JOIN values "\", \"" quoted)
  string(APPEND text "\ninline constexpr std::array<std::string_view, ${count}> k${name}Names{\"${quoted}\"};\n")
  if(name MATCHES "^(LevelIndex|TouchAudience|Release)$")
    continue()   # core's own types; flatbuffer_convert.cpp checks that both list the same names
  endif()
  string(APPEND text
    "enum class ${name} : std::uint8_t { ${commas} };\n"
    "inline constexpr ${name} k${name}Last = ${name}::${last};\n"
    "constexpr const char* to_string(${name} value) {\n"
    "  return value <= k${name}Last ? k${name}Names[static_cast<std::size_t>(value)].data() : \"unknown\";\n}\n")
endforeach()
file(CONFIGURE OUTPUT ${PROJECT_BINARY_DIR}/schema/enums.hpp @ONLY CONTENT "#pragma once

// Made from enums.fbs.
#include <array>
#include <cstddef>
#include <cstdint>
#include <string_view>

namespace hairnet::wire {
${text}
}  // namespace hairnet::wire
")

file(READ ${schema_dir}/messages.fbs schema)
string(REGEX MATCH "union Body {[^}]*}" union "${schema}")
listed_names("${union}" messages)
list(JOIN messages ", " commas)
set(declared)
set(codecs)
foreach(name IN LISTS messages)
  string(APPEND declared "struct ${name};\n")
  string(APPEND codecs "flatbuffers::Offset<fb::${name}> write(flatbuffers::FlatBufferBuilder& to, const ${name}& message);\n"
                       "std::string read(const fb::${name}& in, ${name}& out);\n")
endforeach()
file(CONFIGURE OUTPUT ${PROJECT_BINARY_DIR}/schema/wire/message.hpp @ONLY CONTENT "#pragma once

// Made from union Body of messages.fbs. The structs are in client_messages.hpp and server_messages.hpp.
#include <variant>

namespace hairnet::wire {

${declared}
using Message = std::variant<${commas}>;

}  // namespace hairnet::wire
")
file(CONFIGURE OUTPUT ${PROJECT_BINARY_DIR}/schema/wire/generated/codec_generated.h @ONLY CONTENT "#pragma once

// Made from union Body of messages.fbs. Defined in client_messages.cpp and server_messages.cpp. message_codec.hpp includes
// this file.
namespace hairnet::wire {

${codecs}
}  // namespace hairnet::wire
")
