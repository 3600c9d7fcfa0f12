#include "tests/gallery/cost.hpp"

#include <GLES3/gl3.h>

#include <algorithm>
#include <chrono>
#include <cstdio>
#include <functional>

#include "client/draw/groom_geometry.hpp"
#include "client/render/egl_context.hpp"
#include "client/render/gl_objects.hpp"
#include "client/render/lattice_pass.hpp"
#include "client/render/picture.hpp"
#include "client/render/picture_target.hpp"
#include "client/render/projection.hpp"
#include "core/random.hpp"

namespace hairnet::gallery {
namespace {

// Each time is the shortest of so many.
constexpr int kRounds = 7;

constexpr const char* kLineVertex = R"(#version 300 es
layout(location = 0) in vec3 position;
uniform mat4 to_clip;
void main() { gl_Position = to_clip * vec4(position, 1.0); })";
constexpr const char* kLineFragment = R"(#version 300 es
precision mediump float;
out vec4 colour;
void main() { colour = vec4(0.2, 0.1, 0.05, 1.0); })";

// Lines of one pixel and one colour through points that stay where they are.
class PlainLines {
 public:
  explicit PlainLines(const draw::GroomGeometry& geometry) : program_(glCreateProgram()) {
    for (const auto& [stage, text] : {std::pair{GL_VERTEX_SHADER, kLineVertex}, {GL_FRAGMENT_SHADER, kLineFragment}}) {
      const GLuint shader = glCreateShader(static_cast<GLenum>(stage));
      glShaderSource(shader, 1, &text, nullptr);
      glCompileShader(shader);
      glAttachShader(program_, shader);
      glDeleteShader(shader);
    }
    glLinkProgram(program_);
    std::vector<float> positions;
    for (const auto& point : geometry.strand_points.rest)
      positions.insert(positions.end(), point.begin(), point.begin() + 3);
    std::vector<std::uint32_t> lines;
    // A segment of a strand is drawn as two triangles with six indices, and each point is two vertices. The first and
    // the third index belong to the segment's two points.
    const auto& triangles = geometry.simplified_strands.front().triangles;
    for (std::size_t t = 0; t < triangles.size(); t += 6)
      lines.insert(lines.end(), {triangles[t] / 2, triangles[t + 2] / 2});
    count_ = static_cast<GLsizei>(lines.size());
    glBindVertexArray(array_.name());
    glBindBuffer(GL_ARRAY_BUFFER, points_.name());
    glBufferData(GL_ARRAY_BUFFER, static_cast<GLsizeiptr>(positions.size() * sizeof(float)), positions.data(),
                 GL_STATIC_DRAW);
    glEnableVertexAttribArray(0);
    glVertexAttribPointer(0, 3, GL_FLOAT, GL_FALSE, 0, nullptr);
    glBindBuffer(GL_ELEMENT_ARRAY_BUFFER, indices_.name());
    glBufferData(GL_ELEMENT_ARRAY_BUFFER, static_cast<GLsizeiptr>(lines.size() * sizeof(std::uint32_t)), lines.data(),
                 GL_STATIC_DRAW);
  }
  ~PlainLines() { glDeleteProgram(program_); }
  PlainLines(const PlainLines&) = delete;
  PlainLines& operator=(const PlainLines&) = delete;

  void draw(const Eigen::Matrix4f& to_clip) const {
    glEnable(GL_DEPTH_TEST);
    glClear(GL_DEPTH_BUFFER_BIT | GL_COLOR_BUFFER_BIT);
    glUseProgram(program_);
    glUniformMatrix4fv(glGetUniformLocation(program_, "to_clip"), 1, GL_FALSE, to_clip.data());
    glBindVertexArray(array_.name());
    glDrawElements(GL_LINES, count_, GL_UNSIGNED_INT, nullptr);
  }

 private:
  GLuint program_;
  render::VertexArray array_;
  render::Buffer points_, indices_;
  GLsizei count_ = 0;
};

// The fastest of several rounds: other load on the machine can only add time.
double fastest_ms(const std::function<void()>& draw) {
  double best = 1e9;
  for (int round = 0; round < kRounds; ++round) {
    glFinish();
    const auto begin = std::chrono::steady_clock::now();
    draw();
    glFinish();
    best = std::min(best, std::chrono::duration<double, std::milli>(std::chrono::steady_clock::now() - begin).count());
  }
  return best;
}

// Makes a basis as large as that of a hairstyle, with random modes, since only the size matters for the time.
Basis any_basis(std::size_t node_count) {
  Basis basis{node_count, std::vector<float>(kModeCountMax, 0.01f), std::vector<float>(kModeCountMax, 1e-4f), {}};
  Random random(1);
  for (std::size_t i = 0; i < 3 * node_count * kModeCountMax; ++i)
    basis.modes.push_back(static_cast<std::int16_t>(32767 * random.symmetric()));
  return basis;
}

}  // namespace

Result<void> print_lattice_cost(const Hairstyle& style) {
  const Result<render::EglContext> context = render::EglContext::create();
  if (!context) return Refusal(context.error());
  Result<render::LatticePass> pass = render::LatticePass::build();
  if (!pass) return Refusal(pass.error());
  render::VectorTexture records_texture(render::kRecordsUnit, draw::CharacterRecords::kRecordTexels);
  const LevelGeometry& geometry = (*style.levels)[LevelIndex::high].geometry;
  const auto basis = std::make_shared<const Basis>(any_basis(geometry.active_nodes.size()));
  const auto ms_of = [&](std::size_t count, std::size_t coefficient_count, draw::NodeSum sum, bool sleeps) {
    std::vector<float> coefficients(coefficient_count, 0.01f);
    draw::ShownCharacter character;
    character.lattice = {&geometry, {}, basis, coefficients};
    const std::vector<draw::ShownCharacter> characters(count, character);
    draw::CharacterRecords records;
    return fastest_ms([&] {
      // Lattices whose coefficients do not change are not computed again.
      if (!sleeps) coefficients[0] *= -1;
      records.begin(characters, sum);
      for (std::size_t i = 0; i < count; ++i) records.add(i, Vec3::Zero(), {}, 1, {});
      records_texture.fill(records.records());
      pass->run(records);
    });
  };
  std::printf("drawn by %s\n", reinterpret_cast<const char*>(glGetString(GL_RENDERER)));
  std::printf("nodes of lattices, ms  summed up by the GPU  by the processor  asleep\n");
  for (const std::size_t count : {1, 32, 500}) {
    for (const std::size_t coefficient_count : {kModeCountMax, kModeCountMax / 2, kModeCountMax / 16}) {
      const auto ms = [&](draw::NodeSum sum, bool sleeps) { return ms_of(count, coefficient_count, sum, sleeps); };
      std::printf("%3zu of %3zu coefficients %18.3f %17.3f %7.3f\n", count, coefficient_count,
                  ms(draw::NodeSum::gpu, false), ms(draw::NodeSum::processor, false), ms(draw::NodeSum::gpu, true));
    }
  }
  std::printf("on the GPU: %.1f MB of the basis\n", 1e-6 * static_cast<double>(pass->basis_bytes()));
  return {};
}

Result<void> print_draw_cost(const Hairstyle& style, int width_px, int height_px) {
  const auto moments = simulate_motion(style, "made:dance", LevelIndex::high, {1.6});
  if (!moments) return Refusal(moments.error());
  const Result<render::EglContext> context = render::EglContext::create();
  if (!context) return Refusal(context.error());
  const Result<std::unique_ptr<render::Stage>> stage = render::Stage::create();
  if (!stage) return Refusal(stage.error());
  render::PictureTarget target;
  if (!target.resize(width_px, height_px, 1)) return Refusal("no room for the picture");
  target.begin_large();
  // Hair alone: bodies cost the same either way.
  const std::size_t groom = (*stage)->add_groom(*style.groom);
  draw::ShownCharacter character = shown(groom, moments->front());
  character.body_shown = false;
  draw::Camera camera;
  camera.target = character.pose.head().position - Vec3(0, 0.1, 0);
  camera.eye = camera.target + Vec3(0.4, 0.1, 1.3);

  const draw::GroomGeometry geometry = draw::make_groom_geometry(*style.groom);
  const PlainLines lines(geometry);
  const Eigen::Matrix3f axes =
      (render::view_rotation(camera) * character.pose.head().rotation.toRotationMatrix()).cast<float>();
  Eigen::Matrix4f view = Eigen::Matrix4f::Identity();
  view.topLeftCorner<3, 3>() = axes;
  view.topRightCorner<3, 1>() =
      (render::view_rotation(camera) * (character.pose.head().position - camera.eye)).cast<float>();
  const Eigen::Matrix4f to_clip =
      render::perspective(camera, static_cast<float>(width_px) / static_cast<float>(height_px), 0.1f, 10) * view;

  const double empty_ms = fastest_ms([&] { (*stage)->draw({}, camera, {}, width_px, height_px, true, {}); });
  const double lines_ms = fastest_ms([&] { lines.draw(to_clip); });
  std::printf("%s, %zu strands, %zu points, %d x %d pixels of 4 samples; background alone %.2f ms (taken off below)\n",
              style.name.c_str(), geometry.strand_count, geometry.strand_points.rest.size(), width_px, height_px,
              empty_ms);
  std::printf("%-38s %8s %12s %10s\n", "", "ms", "a ms", "x lines");
  std::printf("%-38s %8.2f %7.0f strands\n", "plain lines, no FFD, no light", lines_ms,
              static_cast<double>(geometry.strand_count) / lines_ms);
  struct Way {
    const char* name;
    draw::DrawDetail detail;
  };
  std::vector<Way> ways{{"strands, quadratic FFD, lit", {}},
                        {"strands, linear FFD, lit", {}},
                        {"strands, rigid, lit", {}},
                        {"strands, quadratic, 2 follow_hairs each", {}},
                        {"strands at 4 mm of their points", {}}};
  // The indices are those of `ways`. The rigid strands, number 2, have no lattice (see below).
  for (Way& way : ways) way.detail.follow_hair_count = 0;
  ways[1].detail.quadratic = 0;
  ways[3].detail.follow_hair_count = 2;
  // A tolerance of 1 m chooses the coarsest of the lists of indices.
  ways[4].detail.tolerance_m = 1;
  for (const Way& way : ways) {
    character.detail = way.detail;
    const MovedLattice lattice = character.lattice;
    if (&way == &ways[2]) character.lattice = {};
    const double ms = fastest_ms([&] {
                        (*stage)->draw({&character, 1}, camera, {}, width_px, height_px, true, {});
                      }) -
                      empty_ms;
    character.lattice = lattice;
    const render::StageStatistics& s = (*stage)->statistics();
    std::printf("%-38s %8.2f %7.0f strands %8.1f\n", way.name, ms, static_cast<double>(s.strands) / ms, ms / lines_ms);
  }
  Result<render::Picture> picture = render::Picture::build();
  if (!picture) return Refusal(picture.error());
  character.detail.reset();
  character.body_shown = true;
  character.id = 1;
  target.begin_large();
  const double single_ms = fastest_ms([&] {
    (*stage)->draw({&character, 1}, camera, {}, width_px, height_px, false, {});
  });
  const double averaged_ms = fastest_ms([&] {
    picture->draw(**stage, {&character, 1}, camera, {}, width_px, height_px);
  });
  std::printf("a window's picture of all of it: %.2f ms; averaged with those before it: %.2f ms\n", single_ms,
              averaged_ms);
  const render::StageStatistics& s = (*stage)->statistics();
  std::printf("on the GPU: %.1f MB of the groom, %zu bytes a character at this level, %.1f MB of strands' points\n",
              1e-6 * static_cast<double>(s.groom_bytes), s.character_bytes, 1e-6 * static_cast<double>(s.point_bytes));
  return {};
}

}  // namespace hairnet::gallery
