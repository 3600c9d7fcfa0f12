#pragma once

#include <GLES3/gl3.h>

#include <array>
#include <cstddef>
#include <span>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "core/geometry/vec.hpp"
#include "core/result.hpp"

namespace hairnet::render {

// Texture units of the shaders' samplers. Each sampler has its own, the same in all programs: so a texture that is
// bound once stays there for all passes of a picture. A unit that two programs used differently would make their order
// matter.
inline constexpr GLint kRecordsUnit = 0, kLatticesUnit = 1, kCardTextureUnit = 2, kSourceUnit = 3, kRestPointsUnit = 4,
                       kRestArcsUnit = 5, kDeformedPointsUnit = 6, kPlacedPointsUnit = 7, kDensityUnit = 8,
                       kLightDepthNowUnit = 9, kLightDepthRestUnit = 10, kCurrentUnit = 11, kDepthUnit = 12,
                       kHistoryUnit = 13, kHistoryCountUnit = 14, kSwingUnit = 15, kSkinNodesUnit = 16,
                       kUploadedNodesUnit = 17, kModesUnit = 18;

// A linked pair of shaders. Its context must be current at every use, also at its destruction.
class Program {
 public:
  // Builds files of client/shaders, which are compiled into this program. `read_back` names the outputs that transform
  // feedback records, interleaved. The error is one line: the first of the compiler's log.
  static Result<Program> build(std::string_view vertex, std::string_view fragment,
                               std::span<const char* const> read_back = {});
  Program(Program&& other) noexcept;
  Program& operator=(Program&&) = delete;
  ~Program();

  void use() const { glUseProgram(name_); }
  // Sets a uniform of the program in use: call use() first. Ignores uniforms that the shader does not have, since
  // compilers remove those that are not needed.
  void set(const char* uniform, float value) const { glUniform1f(at(uniform), value); }
  void set(const char* uniform, int value) const { glUniform1i(at(uniform), value); }
  void set(const char* uniform, const Vec3f& v) const { glUniform3f(at(uniform), v.x(), v.y(), v.z()); }
  void set(const char* uniform, float x, float y) const { glUniform2f(at(uniform), x, y); }
  void set(const char* uniform, std::span<const Vec3f> v) const {
    glUniform3fv(at(uniform), static_cast<GLsizei>(v.size()), v.data()->data());
  }
  void set(const char* uniform, std::span<const Eigen::Vector4f> v) const {
    glUniform4fv(at(uniform), static_cast<GLsizei>(v.size()), v.data()->data());
  }
  void set(const char* uniform, std::span<const float> v) const {
    glUniform1fv(at(uniform), static_cast<GLsizei>(v.size()), v.data());
  }
  void set(const char* uniform, const Eigen::Matrix4f& m) const { set(uniform, std::span(&m, 1)); }
  void set(const char* uniform, std::span<const Eigen::Matrix4f> m) const {
    glUniformMatrix4fv(at(uniform), static_cast<GLsizei>(m.size()), GL_FALSE, m.data()->data());
  }

 private:
  explicit Program(GLuint name) : name_(name) {}
  [[nodiscard]] GLint at(const char* uniform) const;

  GLuint name_;
  // The locations of the uniforms that were set so far, by the address of the name: callers pass literals. A second
  // literal of the same text only takes another entry.
  mutable std::vector<std::pair<const char*, GLint>> places_;
};

// Two files of client/shaders.
struct Shaders {
  std::string_view vertex, fragment;
};

// Builds all of them, or returns the error of the first that cannot be built.
template <std::size_t kCount>
Result<std::array<Program, kCount>> build_programs(const Shaders (&shaders)[kCount]) {
  std::vector<Program> built;
  for (const auto& [vertex, fragment] : shaders) {
    Result<Program> program = Program::build(vertex, fragment);
    if (!program) return Refusal(program.error());
    built.push_back(std::move(*program));
  }
  return [&]<std::size_t... kNumbers>(std::index_sequence<kNumbers...>) {
    return std::array<Program, kCount>{std::move(built[kNumbers])...};
  }
  (std::make_index_sequence<kCount>());
}

}  // namespace hairnet::render
