#include "client/render/overlay.hpp"

#include <algorithm>
#include <cstddef>
#include <utility>

#include "client/render/gl_objects.hpp"
#include "client/render/projection.hpp"
#include "client/render/shader_program.hpp"

namespace hairnet::render {
namespace {

// This opacity of hidden parts is enough to see that something is there, and too little to hide the hair in front of
// it.
constexpr float kHiddenAlpha = 0.22f;

Mat4f clip_from_world(const draw::Camera& wanted, const draw::DepthRange& range, int width, int height) {
  const draw::Camera camera = sanitized(wanted);
  const Eigen::Matrix3d rotation = view_rotation(camera);
  Mat4f view = Mat4f::Identity();
  view.topLeftCorner<3, 3>() = rotation.cast<float>();
  // The world's origin is far from the camera in some scenes, and floats are then coarse. An overlay is a help for
  // people, so this precision suffices.
  view.topRightCorner<3, 1>() = (-(rotation * camera.eye)).cast<float>();
  const float aspect = static_cast<float>(width) / static_cast<float>(std::max(1, height));
  return perspective(camera, aspect, range.near_m, range.far_m) * view;
}

}  // namespace

struct Overlay::Gl {
  Program program;
  VertexArray vertex_array;
  Buffer buffer;
};

Overlay::Overlay(std::unique_ptr<Gl> gl) : gl_(std::move(gl)) {}
Overlay::~Overlay() = default;

Result<std::unique_ptr<Overlay>> Overlay::create() {
  Result<Program> program = Program::build("overlay.vert", "overlay.frag");
  if (!program) return Refusal(program.error());
  std::unique_ptr<Overlay> overlay(new Overlay(std::unique_ptr<Gl>(new Gl{std::move(*program), {}, {}})));
  glBindVertexArray(overlay->gl_->vertex_array.name());
  glBindBuffer(GL_ARRAY_BUFFER, overlay->gl_->buffer.name());
  constexpr GLsizei kStride = sizeof(Drawing::Vertex);
  glEnableVertexAttribArray(0);
  glVertexAttribPointer(0, 3, GL_FLOAT, GL_FALSE, kStride, nullptr);
  glEnableVertexAttribArray(1);
  glVertexAttribPointer(1, 4, GL_UNSIGNED_BYTE, GL_TRUE, kStride,
                        reinterpret_cast<const void*>(offsetof(Drawing::Vertex, colour)));
  glBindVertexArray(0);
  return overlay;
}

void Overlay::draw(const Drawing& drawing, const draw::Camera& camera, const draw::DepthRange& range, int width,
                   int height) {
  if (drawing.empty()) return;
  glViewport(0, 0, width, height);
  glDisable(GL_CULL_FACE);
  glDisable(GL_SAMPLE_ALPHA_TO_COVERAGE);
  glEnable(GL_DEPTH_TEST);
  // Overlays do not hide each other.
  glDepthMask(GL_FALSE);
  glEnable(GL_BLEND);
  // Alpha stays as it is: a window's alpha could make it transparent.
  glBlendFuncSeparate(GL_SRC_ALPHA, GL_ONE_MINUS_SRC_ALPHA, GL_ZERO, GL_ONE);
  const Program& program = gl_->program;
  program.use();
  program.set("clip_from_world", clip_from_world(camera, range, width, height));
  program.set("point_px", drawing.point_px);
  glBindVertexArray(gl_->vertex_array.name());
  glBindBuffer(GL_ARRAY_BUFFER, gl_->buffer.name());
  const auto draw_all = [&](const std::vector<Drawing::Vertex>& vertices, GLenum kind) {
    if (vertices.empty()) return;
    program.set("is_point", kind == GL_POINTS ? 1.0f : 0.0f);
    glBufferData(GL_ARRAY_BUFFER, static_cast<GLsizeiptr>(vertices.size() * sizeof(Drawing::Vertex)), vertices.data(),
                 GL_STREAM_DRAW);
    // First what is hidden, faintly, then what is not: each pass keeps the other's pixels by its depth test.
    for (const auto& [depth, alpha] : {std::pair(GL_GREATER, kHiddenAlpha), std::pair(GL_LEQUAL, 1.0f)}) {
      glDepthFunc(static_cast<GLenum>(depth));
      program.set("alpha", alpha);
      glDrawArrays(kind, 0, static_cast<GLsizei>(vertices.size()));
    }
  };
  draw_all(drawing.lines, GL_LINES);
  draw_all(drawing.points, GL_POINTS);
  glBindVertexArray(0);
  glDepthMask(GL_TRUE);
  glDepthFunc(GL_LESS);
  glDisable(GL_BLEND);
}

}  // namespace hairnet::render
