#pragma once

#include <GLES3/gl3.h>

#include <span>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "core/geometry/vec.hpp"
#include "core/result.hpp"

namespace hairnet::render {

// Texture units of the shaders' samplers.
inline constexpr GLint kRecordsUnit = 0, kLatticesUnit = 1, kCardTextureUnit = 2, kSourceUnit = 3, kRestPointsUnit = 4,
                       kRestArcsUnit = 5, kDeformedPointsUnit = 6, kPlacedPointsUnit = 7, kDensityUnit = 8,
                       kLightDepthNowUnit = 9, kLightDepthRestUnit = 10, kCurrentUnit = 11, kDepthUnit = 12,
                       kHistoryUnit = 13, kHistoryCountUnit = 14, kSwingUnit = 15, kSkinNodesUnit = 16,
                       kUploadedNodesUnit = 17, kModesUnit = 18;

// A linked pair of shaders. Its context must be current at every use.
class Program {
 public:
  // Names are files of client/shaders. `read_back`: the outputs that transform feedback records, interleaved.
  static Result<Program> build(std::string_view vertex, std::string_view fragment,
                               std::span<const char* const> read_back = {});
  Program(Program&& other) noexcept;
  Program& operator=(Program&&) = delete;
  ~Program();

  void use() const { glUseProgram(name_); }
  // Sets a uniform of the program in use; ignores uniforms that the shader does not have.
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
  mutable std::vector<std::pair<const char*, GLint>> places_;  // of uniforms used so far; names are literals
};

}  // namespace hairnet::render
