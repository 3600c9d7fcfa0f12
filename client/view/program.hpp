#pragma once

#include <GLES3/gl3.h>

#include <string>
#include <string_view>

#include "core/geometry/vec.hpp"
#include "core/result.hpp"

namespace hairnet::view {

inline constexpr GLuint kStudioBinding = 0;  // of the uniform block Studio
// Texture units of the samplers that studio.glsl names.
inline constexpr GLint kHairFirstDepthUnit = 0, kHairLayersUnit = 1, kBodyDepthUnit = 2, kSourceUnit = 3;

// A linked pair of shaders, each preceded by studio.glsl. Its context must be current whenever it is touched.
class Program {
 public:
  // Names are files of client/view/shaders.
  static Result<Program> build(std::string_view vertex, std::string_view fragment);
  Program(Program&& other) noexcept;
  Program& operator=(Program&&) = delete;
  ~Program();

  void use() const { glUseProgram(name_); }
  // Of the program in use; a uniform that the shader does not have is passed over.
  void set(const char* uniform, float value) const { glUniform1f(at(uniform), value); }
  void set(const char* uniform, int value) const { glUniform1i(at(uniform), value); }
  void set(const char* uniform, const Vec3f& v) const { glUniform3f(at(uniform), v.x(), v.y(), v.z()); }
  void set(const char* uniform, const Eigen::Vector4f& v) const {
    glUniform4f(at(uniform), v.x(), v.y(), v.z(), v.w());
  }

 private:
  explicit Program(GLuint name) : name_(name) {}
  [[nodiscard]] GLint at(const char* uniform) const { return glGetUniformLocation(name_, uniform); }

  GLuint name_;
};

}  // namespace hairnet::view
