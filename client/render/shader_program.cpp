#include "client/render/shader_program.hpp"

#include <algorithm>
#include <utility>

#include "client/render/shader_text.hpp"

namespace hairnet::render {
namespace {

// Drivers' logs have many lines, and end in a zero byte; errors of this program are one line.
std::string first_line(std::string log) {
  log.resize(std::min(log.find('\n'), log.find('\0')) == std::string::npos ? log.size()
                                                                           : std::min(log.find('\n'), log.find('\0')));
  return log.empty() ? "no reason given" : log;
}

Result<GLuint> compile(GLenum stage, std::string_view file) {
  const std::string_view text = shader_text(file);
  if (text.empty()) return Refusal("shader " + std::string(file) + " is not built in");
  const char* const begin = text.data();
  const auto length = static_cast<GLint>(text.size());
  const GLuint shader = glCreateShader(stage);
  glShaderSource(shader, 1, &begin, &length);
  glCompileShader(shader);
  GLint fine = GL_FALSE;
  glGetShaderiv(shader, GL_COMPILE_STATUS, &fine);
  if (fine == GL_TRUE) return shader;
  std::string log(1024, '\0');
  glGetShaderInfoLog(shader, static_cast<GLsizei>(log.size()), nullptr, log.data());
  glDeleteShader(shader);
  return Refusal("shader " + std::string(file) + " does not compile: " + first_line(std::move(log)));
}

// Samplers keep their unit for the life of the program. A location of -1, of a sampler that this program lacks, is
// ignored.
void bind_samplers(GLuint program) {
  glUseProgram(program);
  constexpr std::pair<const char*, GLint> kSamplers[] = {{"records", kRecordsUnit},
                                                         {"lattices", kLatticesUnit},
                                                         {"card_texture", kCardTextureUnit},
                                                         {"source", kSourceUnit},
                                                         {"rest_points", kRestPointsUnit},
                                                         {"rest_arcs", kRestArcsUnit},
                                                         {"deformed_points", kDeformedPointsUnit},
                                                         {"placed_points", kPlacedPointsUnit},
                                                         {"density", kDensityUnit},
                                                         {"light_depth_now", kLightDepthNowUnit},
                                                         {"light_depth_rest", kLightDepthRestUnit},
                                                         {"current", kCurrentUnit},
                                                         {"depth", kDepthUnit},
                                                         {"history", kHistoryUnit},
                                                         {"history_count", kHistoryCountUnit},
                                                         {"average", kHistoryUnit},
                                                         {"swing", kSwingUnit},
                                                         {"skin_nodes", kSkinNodesUnit},
                                                         {"uploaded_nodes", kUploadedNodesUnit},
                                                         {"modes", kModesUnit}};
  for (const auto& [name, unit] : kSamplers) glUniform1i(glGetUniformLocation(program, name), unit);
}

}  // namespace

Result<Program> Program::build(std::string_view vertex, std::string_view fragment,
                               std::span<const char* const> read_back) {
  const Result<GLuint> first = compile(GL_VERTEX_SHADER, vertex);
  if (!first) return Refusal(first.error());
  const Result<GLuint> second = compile(GL_FRAGMENT_SHADER, fragment);
  if (!second) {
    glDeleteShader(*first);
    return Refusal(second.error());
  }
  Program program(glCreateProgram());
  for (const GLuint shader : {*first, *second}) {
    glAttachShader(program.name_, shader);
    // The program still refers to the shader, which goes with it.
    glDeleteShader(shader);
  }
  // Outputs must be named before linking.
  if (!read_back.empty()) {
    glTransformFeedbackVaryings(program.name_, static_cast<GLsizei>(read_back.size()), read_back.data(),
                                GL_INTERLEAVED_ATTRIBS);
  }
  glLinkProgram(program.name_);
  GLint fine = GL_FALSE;
  glGetProgramiv(program.name_, GL_LINK_STATUS, &fine);
  if (fine != GL_TRUE) {
    std::string log(1024, '\0');
    glGetProgramInfoLog(program.name_, static_cast<GLsizei>(log.size()), nullptr, log.data());
    return Refusal("shaders " + std::string(vertex) + " and " + std::string(fragment) +
                   " do not link: " + first_line(std::move(log)));
  }
  bind_samplers(program.name_);
  return program;
}

Program::Program(Program&& other) noexcept : name_(std::exchange(other.name_, 0)), places_(std::move(other.places_)) {}

GLint Program::at(const char* uniform) const {
  for (const auto& [name, place] : places_) {
    // This compares addresses: it is a cache for literals, not a table of names.
    if (name == uniform) return place;
  }
  return places_.emplace_back(uniform, glGetUniformLocation(name_, uniform)).second;
}

Program::~Program() {
  if (name_ != 0) glDeleteProgram(name_);
}

}  // namespace hairnet::render
