// Compares the free-form deformation of the shaders with that of core. Positions and tangents are read back by
// transform feedback.
#include <gmock/gmock.h>

#include <algorithm>
#include <cmath>
#include <numbers>

#include "client/assets/made/made.hpp"
#include "client/draw/groom_geometry.hpp"
#include "client/render/shader_program.hpp"
#include "client/render/skin_texture.hpp"
#include "core/ffd/deform.hpp"
#include "core/levels/fit_lattice.hpp"
#include "core/random.hpp"
#include "tests/support/case_name.hpp"
#include "tests/unit/client/shader_cases.hpp"

namespace hairnet::render {
using namespace draw;

namespace {

// The README of the project promises that strands agree within 0.1 mm.
constexpr float kPosition_m = 1e-4f;
// Rest tangents travel as halves, of 11 bits.
constexpr float kTangent = 2e-3f;

// Points as the shader gets them: x, y, z and the blend of equation 7 in `rest`, and the rest tangent with the
// blend's slope in `direction`.
struct Points {
  std::vector<std::array<float, 4>> rest;
  std::vector<Half4> direction;

  void add(const std::array<float, 4>& point, const Half4& along) {
    rest.push_back(point);
    direction.push_back(along);
  }
  // Adds all drawn parts of a groom that follow the lattice.
  void add(const GroomGeometry& geometry) {
    for (const auto& point : geometry.strand_points.rest) add(point, {});
    for (const CardVertex& vertex : geometry.cards.vertices) add(vertex.rest, vertex.direction);
    for (const FabricVertex& vertex : geometry.fabric.vertices) add(vertex.rest, vertex.direction);
  }
  [[nodiscard]] std::vector<Vec3f> positions() const {
    std::vector<Vec3f> positions;
    for (const auto& [x, y, z, delta] : rest) positions.emplace_back(x, y, z);
    return positions;
  }
  [[nodiscard]] std::vector<float> blend() const {
    std::vector<float> blend;
    for (const auto& point : rest) blend.push_back(point[3]);
    return blend;
  }
  [[nodiscard]] RestTangents tangents() const {
    RestTangents tangents;
    const auto number = [](std::uint16_t bits) {
      return Eigen::half_impl::half_to_float(Eigen::half_impl::raw_uint16_to_half(bits));
    };
    for (const Half4& d : direction) {
      tangents.direction.emplace_back(number(d[0]), number(d[1]), number(d[2]));
      tangents.blend_slope.push_back(number(d[3]));
    }
    return tangents;
  }
};

struct Deformed {
  std::vector<Vec3f> positions, tangents;
};

class ShaderDeform : public ShaderTest {
 protected:
  void set_up_drawing() override {
    constexpr std::array<const char*, 2> kRead{"position_head", "tangent_head"};
    Result<Program> program = Program::build("deform.vert", "nothing.frag", kRead);
    ASSERT_TRUE(program) << program.error();
    program_.emplace(std::move(*program));
    // Nothing is drawn, but OpenGL needs a target.
    target_.emplace();
    glBindTexture(GL_TEXTURE_2D, pixel_.emplace().name());
    glTexStorage2D(GL_TEXTURE_2D, 1, GL_RGBA8, 1, 1);
    glBindFramebuffer(GL_FRAMEBUFFER, target_->name());
    glFramebufferTexture2D(GL_FRAMEBUFFER, GL_COLOR_ATTACHMENT0, GL_TEXTURE_2D, pixel_->name(), 0);
  }
  void tear_down_drawing() override {
    target_.reset();
    pixel_.reset();
    program_.reset();
  }

  // Runs deform.vert over the points and reads back what it computes, for the second of two characters. Without
  // nodes the hair is at rest.
  Deformed by_shader(const Points& points, const Nodes* nodes, float quadratic, const SkinTexture& skin = {}) {
    fill_records(nodes, quadratic);

    const VertexArray array;
    const Buffer rest, direction, out;
    glBindVertexArray(array.name());
    attribute(0, rest, points.rest, GL_FLOAT);
    attribute(1, direction, points.direction, GL_HALF_FLOAT);
    // Each point gives a position and a tangent of three floats each.
    const std::size_t bytes = points.rest.size() * 6 * sizeof(float);
    glBindBuffer(GL_TRANSFORM_FEEDBACK_BUFFER, out.name());
    glBufferData(GL_TRANSFORM_FEEDBACK_BUFFER, static_cast<GLsizeiptr>(bytes), nullptr, GL_STREAM_READ);
    glBindBufferBase(GL_TRANSFORM_FEEDBACK_BUFFER, 0, out.name());
    program_->use();
    program_->set("first_record", 1);
    program_->set("copies", 1);
    skin.use(*program_);
    glEnable(GL_RASTERIZER_DISCARD);
    glBeginTransformFeedback(GL_POINTS);
    glDrawArrays(GL_POINTS, 0, static_cast<GLsizei>(points.rest.size()));
    glEndTransformFeedback();
    glDisable(GL_RASTERIZER_DISCARD);
    Deformed deformed;
    const auto* read = static_cast<const float*>(
        glMapBufferRange(GL_TRANSFORM_FEEDBACK_BUFFER, 0, static_cast<GLsizeiptr>(bytes), GL_MAP_READ_BIT));
    for (std::size_t i = 0; read != nullptr && i < points.rest.size(); ++i) {
      deformed.positions.emplace_back(read[6 * i], read[6 * i + 1], read[6 * i + 2]);
      deformed.tangents.emplace_back(read[6 * i + 3], read[6 * i + 4], read[6 * i + 5]);
    }
    glUnmapBuffer(GL_TRANSFORM_FEEDBACK_BUFFER);
    EXPECT_EQ(glGetError(), static_cast<GLenum>(GL_NO_ERROR));
    return deformed;
  }

  // Returns what core makes of the points with one lattice.
  static Deformed by_core(const Points& points, const Nodes& nodes, FfdKind kind) {
    Deformed deformed{std::vector<Vec3f>(points.rest.size()), std::vector<Vec3f>(points.rest.size())};
    const Deformer deformer(nodes.geometry.lattice, points.positions(), points.blend(), points.tangents(), kind);
    deformer.deform(nodes.displacements, deformed.positions, deformed.tangents);
    return deformed;
  }

  // Returns whether a point lies on a plane of the lattice. Linear FFD bends there, and rounding decides which of two
  // tangents is used.
  static bool is_bend(const Lattice& lattice, const Vec3f& x) {
    const Vec3f g = (x - lattice.origin).cwiseQuotient(lattice.spacing);
    return (g.array() - g.array().round()).abs().minCoeff() < 1e-4f;
  }

  // Returns what core's linear FFD makes of the points. On the planes of the lattice the tangents are those of the
  // shader, since either is right.
  static Deformed linear_by_core(const Points& points, const Nodes& nodes, const Deformed& shader) {
    Deformed deformed = by_core(points, nodes, FfdKind::linear);
    const std::vector<Vec3f> rest = points.positions();
    for (std::size_t i = 0; i < rest.size() && i < shader.tangents.size(); ++i) {
      if (is_bend(nodes.geometry.lattice, rest[i])) deformed.tangents[i] = shader.tangents[i];
    }
    return deformed;
  }

  static void expect_equal(const Deformed& shader, const Deformed& core) {
    ASSERT_EQ(shader.positions.size(), core.positions.size());
    float furthest = 0, worst_tangent = 0;
    for (std::size_t i = 0; i < core.positions.size(); ++i) {
      ASSERT_TRUE(shader.positions[i].allFinite() && shader.tangents[i].allFinite()) << i;
      furthest = std::max(furthest, (shader.positions[i] - core.positions[i]).norm());
      worst_tangent =
          std::max(worst_tangent, (shader.tangents[i] - core.tangents[i]).norm() / (1 + core.tangents[i].norm()));
    }
    EXPECT_LT(furthest, kPosition_m);
    EXPECT_LT(worst_tangent, kTangent);
    RecordProperty("furthest_um", static_cast<int>(std::ceil(1e6f * furthest)));
  }

 private:
  template <class T>
  static void attribute(GLuint location, const Buffer& buffer, const std::vector<T>& values, GLenum type) {
    glBindBuffer(GL_ARRAY_BUFFER, buffer.name());
    glBufferData(GL_ARRAY_BUFFER, static_cast<GLsizeiptr>(values.size() * sizeof(T)), values.data(), GL_STATIC_DRAW);
    glEnableVertexAttribArray(location);
    glVertexAttribPointer(location, 4, type, GL_FALSE, 0, nullptr);
  }

  std::optional<Program> program_;
  std::optional<Framebuffer> target_;
  std::optional<Texture> pixel_;
};

// Returns points inside a lattice, on its nodes, and up to a third of its size outside.
Points scattered(const Lattice& lattice) {
  Points points;
  Random random(5);
  const Vec3f extent = Vec3f(static_cast<float>(lattice.dims[0] - 1), static_cast<float>(lattice.dims[1] - 1),
                             static_cast<float>(lattice.dims[2] - 1))
                           .cwiseProduct(lattice.spacing);
  const auto add = [&](const Vec3f& x) {
    const Vec3f t = Vec3(random.symmetric(), random.symmetric(), random.symmetric()).normalized().cast<float>();
    const auto half = [](float v) { return Eigen::half(v).x; };
    points.add({x.x(), x.y(), x.z(), static_cast<float>(random.unit())},
               {half(t.x()), half(t.y()), half(t.z()), half(static_cast<float>(20 * random.unit()))});
  };
  for (int i = 0; i < 20'000; ++i)
    add(lattice.origin + Vec3(random.between(-0.33, 1.33), random.between(-0.33, 1.33), random.between(-0.33, 1.33))
                             .cast<float>()
                             .cwiseProduct(extent));
  for (std::uint32_t n = 0; n < lattice.node_count(); ++n) add(lattice.node(n));
  return points;
}

Lattice lattice_of(const std::array<int, 3>& dims) {
  return {Vec3f(-0.21f, -0.5f, -0.3f), Vec3f(0.05f, 0.07f, 0.06f), dims};
}

TEST_F(ShaderDeform, moves_points_inside_and_outside_of_lattices_as_core_does) {
  // The lattices of the high and the low level, and one with a different count on each axis.
  for (const std::array<int, 3>& dims : {std::array{10, 10, 10}, std::array{5, 5, 5}, std::array{3, 4, 17}}) {
    SCOPED_TRACE(dims[2]);
    const Nodes nodes = rough_nodes(lattice_of(dims), 1);
    const Points points = scattered(nodes.geometry.lattice);
    expect_equal(by_shader(points, &nodes, 1), by_core(points, nodes, FfdKind::quadratic));
    const Deformed linear = by_shader(points, &nodes, 0);
    expect_equal(linear, linear_by_core(points, nodes, linear));
  }
}

TEST_F(ShaderDeform, leaves_hair_without_a_lattice_where_it_is) {
  const Points points = scattered(lattice_of({5, 5, 5}));
  const Deformed still = by_shader(points, nullptr, 1);
  ASSERT_EQ(still.positions.size(), points.rest.size());
  const std::vector<Vec3f> rest = points.positions();
  for (std::size_t i = 0; i < rest.size(); ++i) EXPECT_EQ(still.positions[i], rest[i]);
}

TEST_F(ShaderDeform, goes_from_quadratic_to_linear_in_proportion) {
  const Nodes nodes = rough_nodes(lattice_of({7, 7, 7}), 4);
  const Points points = scattered(nodes.geometry.lattice);
  Deformed mixed = by_core(points, nodes, FfdKind::quadratic);
  const Deformed linear = by_core(points, nodes, FfdKind::linear);
  for (std::size_t i = 0; i < mixed.positions.size(); ++i) {
    // The shader gets 0.25 as its share of quadratic FFD below, so core's results are mixed in this way too.
    mixed.positions[i] = 0.25f * mixed.positions[i] + 0.75f * linear.positions[i];
    mixed.tangents[i] = 0.25f * mixed.tangents[i] + 0.75f * linear.tangents[i];
  }
  expect_equal(by_shader(points, &nodes, 0.25f), mixed);
}

TEST_F(ShaderDeform, leaves_hair_where_it_is_when_a_node_is_not_finite) {
  Nodes nodes = rough_nodes(lattice_of({5, 5, 5}), 1);
  nodes.displacements[7].y() = std::numeric_limits<float>::quiet_NaN();
  const Points points = scattered(nodes.geometry.lattice);
  const Deformed still = by_shader(points, &nodes, 1);
  EXPECT_EQ(still.positions, points.positions());
}

TEST_F(ShaderDeform, keeps_hair_out_of_the_skin_as_core_does) {
  const Groom groom = *make_hairstyle("bob", {.strand_count = 300});
  const SkinPush push(*make_skin(groom), groom.materials.base.thickness_m);
  SkinTexture skin;
  skin.fill(push);
  Points points;
  points.add(make_groom_geometry(groom));
  const std::vector<Vec3f> rest = points.positions();
  EXPECT_EQ(by_shader(points, nullptr, 1, skin).positions, rest);
  pose_ = bent(pose_);
  const Nodes nodes = rough_nodes(fit_lattice(groom.points, {10, 10, 10}), 9);
  Deformed wanted = by_core(points, nodes, FfdKind::quadratic);
  const std::vector<Vec3f> before = wanted.positions;
  push.push(pose_, rest, points.blend(), wanted.positions);
  std::size_t moved = 0;
  for (std::size_t p = 0; p < before.size(); ++p) moved += before[p] != wanted.positions[p];
  // The skin must push many points, or the case would show nothing.
  EXPECT_GT(moved, 1000u);
  expect_equal(by_shader(points, &nodes, 1, skin), wanted);
}

class ShaderDeformGroom : public ShaderDeform, public testing::WithParamInterface<std::string> {};

TEST_P(ShaderDeformGroom, moves_all_of_a_hairstyle_as_core_does) {
  if (!can_load(GetParam())) GTEST_SKIP() << "NOT TESTED: no ../shared/data";
  const Result<Groom> groom = fidelity::load_groom(GetParam(), kMadeStrands);
  ASSERT_TRUE(groom) << groom.error();
  Points points;
  points.add(make_groom_geometry(*groom));
  ASSERT_GT(points.rest.size(), 1000u);
  for (const std::array<int, 3>& dims : {std::array{10, 10, 10}, std::array{5, 5, 5}}) {
    const Nodes nodes = rough_nodes(fit_lattice(groom->points, dims), 9);
    expect_equal(by_shader(points, &nodes, 1), by_core(points, nodes, FfdKind::quadratic));
    const Deformed linear = by_shader(points, &nodes, 0);
    expect_equal(linear, linear_by_core(points, nodes, linear));
  }
}

INSTANTIATE_TEST_SUITE_P(Grooms, ShaderDeformGroom, testing::ValuesIn(all_grooms()), support::CaseName());

}  // namespace
}  // namespace hairnet::render
