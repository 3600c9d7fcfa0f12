#include <gmock/gmock.h>

#include <cmath>
#include <limits>
#include <numbers>

#include "client/view/light_rig.hpp"
#include "client/view/renderer.hpp"

namespace hairnet::view {
namespace {

constexpr int kSide = 96;  // px, of most pictures here
constexpr float kNan = std::numeric_limits<float>::quiet_NaN();

struct Scene {
  TriangleMesh body;
  std::vector<Vec3f> points;
  std::vector<std::uint32_t> begin{0};

  void add_strand(const std::vector<Vec3f>& strand) {
    points.insert(points.end(), strand.begin(), strand.end());
    begin.push_back(static_cast<std::uint32_t>(points.size()));
  }
  [[nodiscard]] DrawnCharacter character() const {
    DrawnCharacter c;
    c.body_vertices = body.vertices;
    c.triangles = &body.triangles;
    c.strand_points = points;
    c.strand_begin = begin;
    return c;
  }
};

TriangleMesh sphere(const Vec3f& centre, float radius) {
  constexpr std::uint32_t kRings = 16, kSectors = 24;
  TriangleMesh mesh;
  for (std::uint32_t i = 0; i <= kRings; ++i) {
    const float down = std::numbers::pi_v<float> * static_cast<float>(i) / kRings;
    for (std::uint32_t j = 0; j < kSectors; ++j) {
      const float round = 2 * std::numbers::pi_v<float> * static_cast<float>(j) / kSectors;
      mesh.vertices.push_back(
          centre + radius * Vec3f(std::sin(down) * std::sin(round), std::cos(down), std::sin(down) * std::cos(round)));
      if (i == kRings) continue;
      const std::uint32_t a = i * kSectors + j, b = i * kSectors + (j + 1) % kSectors;
      mesh.triangles.push_back({a, a + kSectors, b});
      mesh.triangles.push_back({b, a + kSectors, b + kSectors});
    }
  }
  return mesh;
}

// A camera at z = 1 m that sees 0.5 m of the plane z = 0 from edge to edge.
const Camera kCamera{{0, 0, 1}, {0, 0, 0}, {0, 1, 0}, 2 * 180 / std::numbers::pi_v<float>* std::atan(0.25f)};
int column_of(float x_m) {
  return static_cast<int>((x_m / 0.5f + 0.5f) * kSide);
}
int row_of(float y_m) {
  return static_cast<int>((0.5f - y_m / 0.5f) * kSide);
}

std::array<int, 3> pixel(const Image& image, int x, int y) {
  const std::size_t at = 4 * static_cast<std::size_t>(y * image.width + x);
  return {image.rgba[at], image.rgba[at + 1], image.rgba[at + 2]};
}

int difference(const Image& a, const Image& b, int x, int y) {
  const auto p = pixel(a, x, y), q = pixel(b, x, y);
  return std::abs(p[0] - q[0]) + std::abs(p[1] - q[1]) + std::abs(p[2] - q[2]);
}

// How much darker `with` is, in linear light, summed over the picture.
double light_taken(const Image& without, const Image& with) {
  const auto linear = [](int byte) { return std::pow((byte / 255.0 + 0.055) / 1.055, 2.4); };
  double sum = 0;
  for (std::size_t i = 0; i < with.rgba.size(); i += 4) sum += linear(without.rgba[i]) - linear(with.rgba[i]);
  return sum;
}

class ViewRenderer : public testing::Test {
 protected:
  void SetUp() override { make(Look{}); }

  void make(const Look& look) {
    auto made = Renderer::create(look);
    if (!made && made.error().starts_with("no off-screen OpenGL ES 3")) GTEST_SKIP() << "NOT TESTED: " << made.error();
    ASSERT_TRUE(made) << made.error();
    renderer_ = std::move(*made);
  }
  Image draw(std::span<const DrawnCharacter> characters) {
    auto image = renderer_->draw(characters, kCamera, kSide, kSide);
    EXPECT_TRUE(image) << image.error();
    return image ? std::move(*image) : Image{};
  }
  Image draw(const Scene& scene) {
    const DrawnCharacter character = scene.character();
    return draw(std::span(&character, 1));
  }
  Image draw_nothing() { return draw(std::span<const DrawnCharacter>{}); }

  std::unique_ptr<Renderer> renderer_;
};

TEST_F(ViewRenderer, shows_an_empty_scene_as_grey_background_lighter_at_the_top) {
  const Image image = draw_nothing();
  ASSERT_EQ(image.rgba.size(), 4u * kSide * kSide);
  for (int y = 0; y < kSide; ++y) {
    const auto [r, g, b] = pixel(image, kSide / 2, y);
    EXPECT_NEAR(r, g, 6);
    EXPECT_NEAR(g, b, 6);
    EXPECT_GT(r, 150);
    EXPECT_EQ(image.rgba[4 * static_cast<std::size_t>(y * kSide) + 3], 255);
  }
  EXPECT_GT(pixel(image, kSide / 2, 2)[0], pixel(image, kSide / 2, kSide - 3)[0] + 10);
  EXPECT_EQ(draw(Scene{}).rgba, image.rgba) << "a character of nothing";
}

TEST_F(ViewRenderer, shows_a_red_sphere_where_it_stands) {
  Scene scene;
  scene.body = sphere({0.1f, 0.05f, 0}, 0.06f);
  DrawnCharacter character = scene.character();
  character.skin_colour = Vec3f(0.8f, 0.02f, 0.02f);
  const Image image = draw(std::span(&character, 1)), empty = draw_nothing();
  for (int y = 0; y < kSide; ++y) {
    for (int x = 0; x < kSide; ++x) {
      const float dx = (static_cast<float>(x) + 0.5f - static_cast<float>(column_of(0.1f))) * 0.5f / kSide;
      const float dy = (static_cast<float>(y) + 0.5f - static_cast<float>(row_of(0.05f))) * 0.5f / kSide;
      const float away = std::hypot(dx, dy);
      if (away < 0.045f) {
        EXPECT_GT(pixel(image, x, y)[0], 2 * pixel(image, x, y)[1]) << x << ' ' << y;
      }
      if (away > 0.075f) {
        EXPECT_EQ(difference(image, empty, x, y), 0) << x << ' ' << y;
      }
    }
  }
}

TEST_F(ViewRenderer, covers_pixels_between_a_strands_ends_and_nowhere_far_away) {
  Look look;
  look.follower_count = 0;
  make(look);
  Scene scene;
  scene.add_strand({{-0.15f, 0, 0}, {-0.05f, 0, 0}, {0.05f, 0, 0}, {0.15f, 0, 0}});
  DrawnCharacter character = scene.character();
  character.strand_width_m = 5e-3f;
  const Image image = draw(std::span(&character, 1)), empty = draw_nothing();
  for (int x = 0; x < kSide; ++x) {
    const int middle = difference(image, empty, x, row_of(0)) + difference(image, empty, x, row_of(0) - 1);
    if (x > column_of(-0.14f) && x < column_of(0.10f)) {
      EXPECT_GT(middle, 60) << x;
    }
    for (int y = 0; y < kSide; ++y) {
      const bool near = x >= column_of(-0.15f) - 2 && x <= column_of(0.15f) + 2 && std::abs(y - row_of(0)) <= 3;
      if (!near) {
        EXPECT_EQ(difference(image, empty, x, y), 0) << x << ' ' << y;
      }
    }
  }
}

TEST_F(ViewRenderer, turns_width_below_a_pixel_into_coverage) {
  Look look;
  look.follower_count = 0;
  make(look);
  Scene scene;
  scene.add_strand({{-0.1f, 0.02f, 0}, {0.1f, -0.03f, 0}});
  DrawnCharacter character = scene.character();
  character.hair_colour = Vec3f(0, 0, 0);
  const Image empty = draw_nothing();
  std::array<double, 3> taken{};
  for (std::size_t i = 0; i < taken.size(); ++i) {
    character.strand_width_m = 4e-4f * std::pow(2.0f, static_cast<float>(i));  // a pixel is 5.2e-3 m
    taken[i] = light_taken(empty, draw(std::span(&character, 1)));
  }
  EXPECT_GT(taken[0], 0.3);
  EXPECT_NEAR(taken[1] / taken[0], 2, 0.4);
  EXPECT_NEAR(taken[2] / taken[1], 2, 0.4);
}

TEST_F(ViewRenderer, shows_followers_beside_their_strand) {
  Scene scene;
  scene.add_strand({{0, 0.1f, 0}, {0, 0, 0}, {0, -0.1f, 0}});
  const Image empty = draw_nothing(), three = draw(scene);
  Look look;
  look.follower_count = 0;
  make(look);
  EXPECT_GT(light_taken(empty, three), 1.5 * light_taken(empty, draw(scene)));
}

TEST_F(ViewRenderer, casts_the_shadow_of_hair_on_skin) {
  Scene scene;
  scene.body.vertices = {{-0.25f, -0.25f, 0}, {0.25f, -0.25f, 0}, {0.25f, 0.25f, 0}, {-0.25f, 0.25f, 0}};
  scene.body.triangles = {{0, 1, 2}, {0, 2, 3}};
  const Image lit = draw(scene);
  const Vec3f middle = 0.09f * studio_lights(kCamera).towards[0];
  for (int i = -50; i <= 50; ++i) {
    const Vec3f p = middle + Vec3f(0, 6e-4f * static_cast<float>(i), 0);
    scene.add_strand({p - Vec3f(0.03f, 0, 0), p, p + Vec3f(0.03f, 0, 0)});
  }
  DrawnCharacter character = scene.character();
  character.strand_width_m = 1e-3f;
  const Image shaded = draw(std::span(&character, 1));
  EXPECT_LT(pixel(shaded, kSide / 2, kSide / 2)[0], pixel(lit, kSide / 2, kSide / 2)[0] - 25);
  EXPECT_NEAR(pixel(shaded, column_of(0.2f), row_of(0.2f))[0], pixel(lit, column_of(0.2f), row_of(0.2f))[0], 12);
}

TEST_F(ViewRenderer, hides_the_further_character_behind_the_nearer_in_either_order) {
  Scene back, front;
  back.body = sphere({0, 0, -0.1f}, 0.08f);
  front.body = sphere({0, 0, 0.1f}, 0.05f);
  std::array<DrawnCharacter, 2> pair{back.character(), front.character()};
  pair[0].skin_colour = Vec3f(0.02f, 0.02f, 0.8f);
  pair[1].skin_colour = Vec3f(0.8f, 0.02f, 0.02f);
  const Image image = draw(pair);
  EXPECT_GT(pixel(image, kSide / 2, kSide / 2)[0], 2 * pixel(image, kSide / 2, kSide / 2)[2]);
  EXPECT_GT(pixel(image, column_of(0.065f), row_of(0))[2], 2 * pixel(image, column_of(0.065f), row_of(0))[0]);
  std::swap(pair[0], pair[1]);
  EXPECT_EQ(draw(pair).rgba, image.rgba);
}

// A sheet of 20 cm, facing the camera or with its back to it.
struct Sheet {
  explicit Sheet(bool facing) : triangles{{{0, 1, 2}, {0, 2, 3}}} {
    if (!facing) std::swap(points[1], points[3]);
  }
  std::array<Vec3f, 4> points{Vec3f(-0.1f, -0.1f, 0), Vec3f(0.1f, -0.1f, 0), Vec3f(0.1f, 0.1f, 0),
                              Vec3f(-0.1f, 0.1f, 0)};
  std::array<std::array<std::uint32_t, 3>, 2> triangles;
  [[nodiscard]] DrawnSurface surface(float opacity = 1) const {
    return {.points = points, .triangles = triangles, .colour = Vec3f(0.02f, 0.7f, 0.02f), .opacity = opacity};
  }
};

TEST_F(ViewRenderer, shows_cloth_from_both_sides) {
  const Image empty = draw_nothing();
  for (const bool facing : {true, false}) {
    const Sheet sheet(facing);
    const DrawnSurface surface = sheet.surface();
    DrawnCharacter character;
    character.surfaces = std::span(&surface, 1);
    const Image image = draw(std::span(&character, 1));
    for (const float at : {-0.08f, 0.0f, 0.08f}) {
      const auto [r, g, b] = pixel(image, column_of(at), row_of(at));
      EXPECT_GT(g, 2 * r) << facing;
      EXPECT_GT(g, 60) << "lit, " << facing;
    }
    EXPECT_EQ(difference(image, empty, column_of(0.14f), row_of(0)), 0);
  }
}

TEST_F(ViewRenderer, lets_sight_through_thin_cloth_and_hides_what_is_behind_thick) {
  Scene scene;
  scene.body = sphere({0, 0, -0.12f}, 0.06f);
  const Sheet sheet(true);
  std::array<double, 3> red{};
  for (std::size_t i = 0; i < red.size(); ++i) {
    const DrawnSurface surface = sheet.surface(0.5f * static_cast<float>(i));
    DrawnCharacter character = scene.character();
    character.skin_colour = Vec3f(0.8f, 0.02f, 0.02f);
    character.surfaces = std::span(&surface, 1);
    const Image image = draw(std::span(&character, 1));
    for (int x = kSide / 2 - 4; x < kSide / 2 + 4; ++x) red[i] += pixel(image, x, kSide / 2)[0];
  }
  EXPECT_GT(red[0], red[1] + 150);
  EXPECT_GT(red[1], red[2] + 150);
}

TEST_F(ViewRenderer, shows_threads_round_and_strips_in_the_hairs_colour) {
  const std::array<Vec3f, 3> line{Vec3f(-0.1f, 0.1f, 0), Vec3f(0, 0.1f, 0), Vec3f(0.1f, 0.1f, 0)};
  const std::array<Vec3f, 6> edges{Vec3f(-0.02f, 0, 0),     Vec3f(0.02f, 0, 0),      Vec3f(-0.02f, -0.06f, 0),
                                   Vec3f(0.02f, -0.06f, 0), Vec3f(-0.02f, -0.2f, 0), Vec3f(0.02f, -0.2f, 0)};
  const std::array<DrawnSurface, 2> surfaces{
      DrawnSurface{
          .kind = DrawnSurface::Kind::thread, .points = line, .colour = {0.02f, 0.02f, 0.8f}, .radius_m = 0.01f},
      DrawnSurface{.kind = DrawnSurface::Kind::strip, .points = edges}};
  DrawnCharacter character;
  character.hair_colour = Vec3f(0.6f, 0.05f, 0.05f);
  character.surfaces = surfaces;
  const Image image = draw(std::span(&character, 1)), empty = draw_nothing();
  EXPECT_GT(pixel(image, column_of(0.05f), row_of(0.1f))[2], 2 * pixel(image, column_of(0.05f), row_of(0.1f))[0]);
  EXPECT_GT(difference(image, empty, column_of(0.05f), row_of(0.1f) - 1), 60) << "as wide as its radius asks";
  EXPECT_EQ(difference(image, empty, column_of(0.05f), row_of(0.1f) + 5), 0);
  EXPECT_GT(pixel(image, column_of(0), row_of(-0.05f))[0], pixel(image, column_of(0), row_of(-0.05f))[2] + 60);
}

TEST_F(ViewRenderer, refuses_surfaces_that_make_no_sense_and_leaves_out_what_is_not_finite) {
  Sheet sheet(true);
  DrawnSurface surface = sheet.surface();
  DrawnCharacter character;
  character.surfaces = std::span(&surface, 1);
  const auto refusal = [&] {
    const auto image = renderer_->draw(std::span(&character, 1), kCamera, kSide, kSide);
    return image ? std::string("drawn") : image.error();
  };
  surface.first_index = 1;
  EXPECT_THAT(refusal(), testing::HasSubstr("surface 0: a triangle names point 0"));
  surface = sheet.surface(1.5f);
  EXPECT_THAT(refusal(), testing::HasSubstr("opacity"));
  surface = sheet.surface();
  surface.colour.x() = kNan;
  EXPECT_THAT(refusal(), testing::HasSubstr("colour"));
  surface = {.kind = DrawnSurface::Kind::strip, .points = std::span(sheet.points).first(3)};
  EXPECT_THAT(refusal(), testing::HasSubstr("partner"));
  surface = {.kind = DrawnSurface::Kind::thread, .points = sheet.points, .radius_m = 0};
  EXPECT_THAT(refusal(), testing::HasSubstr("radius"));
  sheet.points[2] = Vec3f(kNan, INFINITY, 1e30f);
  for (const auto kind : {DrawnSurface::Kind::cloth, DrawnSurface::Kind::strip, DrawnSurface::Kind::thread}) {
    surface = sheet.surface();
    surface.kind = kind;
    EXPECT_EQ(refusal(), "drawn");
    surface.points = {};
    surface.triangles = {};
    EXPECT_EQ(refusal(), "drawn");
  }
}

TEST_F(ViewRenderer, leaves_out_points_that_are_not_finite) {
  Scene scene, clean;
  scene.body = clean.body = sphere({0, 0, 0}, 0.06f);
  clean.add_strand({{-0.1f, 0, 0.1f}, {0, 0.05f, 0.1f}, {0.1f, 0, 0.1f}});
  clean.add_strand({});
  scene.add_strand({{-0.1f, 0, 0.1f}, {0, 0.05f, 0.1f}, {0.1f, 0, 0.1f}, {0.1f, kNan, 0}});
  scene.add_strand({{0, kNan, 0}, {0, -INFINITY, 0}, {1e38f, 0, 0}});
  EXPECT_EQ(draw(scene).rgba, draw(clean).rgba);
  scene.body.vertices.assign(scene.body.vertices.size(), Vec3f(kNan, 0, INFINITY));
  EXPECT_EQ(draw(scene).rgba.size(), 4u * kSide * kSide);
}

TEST_F(ViewRenderer, shows_nothing_for_strands_of_no_length_or_one_point) {
  Scene scene;
  scene.add_strand({{0, 0, 0}});
  scene.add_strand({});
  EXPECT_EQ(draw(scene).rgba, draw_nothing().rgba);
  scene.add_strand({{0.1f, 0, 0}, {0.1f, 0, 0}, {0.1f, 0, 0}});
  EXPECT_EQ(draw(scene).rgba.size(), 4u * kSide * kSide);
}

TEST_F(ViewRenderer, refuses_sizes_out_of_range_and_draws_the_next_picture) {
  for (const auto& [width, height] : {std::pair{0, 10}, {10, -1}, {kPictureSideMax + 1, 10}, {10, 1 << 30}}) {
    const auto image = renderer_->draw({}, kCamera, width, height);
    ASSERT_FALSE(image);
    EXPECT_THAT(image.error(), testing::HasSubstr("sides must be 1"));
  }
  const auto widest = renderer_->draw({}, kCamera, kPictureSideMax, 3);
  ASSERT_TRUE(widest) << widest.error();
  EXPECT_EQ(widest->width, kPictureSideMax);
  EXPECT_EQ(draw_nothing().width, kSide);
}

TEST_F(ViewRenderer, refuses_offsets_triangles_and_colours_that_make_no_sense) {
  const auto refusal = [&](const DrawnCharacter& character) {
    const auto image = renderer_->draw(std::span(&character, 1), kCamera, kSide, kSide);
    return image ? std::string("drawn") : image.error();
  };
  Scene scene;
  scene.body = sphere({0, 0, 0}, 0.1f);
  scene.add_strand({{0, 0, 0}, {0, 0.1f, 0}});
  EXPECT_EQ(refusal(scene.character()), "drawn");
  Scene bad = scene;
  bad.body.triangles[5][1] = 1'000'000;
  EXPECT_THAT(refusal(bad.character()), testing::HasSubstr("triangle 5 names vertex 1000000"));
  bad = scene;
  bad.begin = {0, 3};
  EXPECT_THAT(refusal(bad.character()), testing::HasSubstr("strands end at point 3 of 2"));
  bad.begin = {2, 0};
  EXPECT_THAT(refusal(bad.character()), testing::HasSubstr("strand 0"));
  DrawnCharacter character = scene.character();
  character.hair_colour.y() = kNan;
  EXPECT_THAT(refusal(character), testing::HasSubstr("hair colour"));
  character = scene.character();
  character.strand_width_m = 0;
  EXPECT_THAT(refusal(character), testing::HasSubstr("strand width"));
  Look look;
  look.supersample = 9;
  EXPECT_FALSE(Renderer::create(look));
}

TEST_F(ViewRenderer, gives_the_same_picture_again_and_from_another_renderer) {
  Scene scene;
  scene.body = sphere({0, 0, 0}, 0.08f);
  for (int i = 0; i < 300; ++i) {
    const float round = static_cast<float>(i) * 0.7f, x = 0.09f * std::sin(round), z = 0.09f * std::cos(round);
    scene.add_strand({{x, 0.05f, z}, {1.1f * x, -0.02f, 1.1f * z}, {x, -0.12f, z}});
  }
  const Image first = draw(scene);
  draw_nothing();
  EXPECT_EQ(draw(scene).rgba, first.rgba);
  auto other = Renderer::create();
  ASSERT_TRUE(other);
  const DrawnCharacter character = scene.character();
  const auto again = (*other)->draw(std::span(&character, 1), kCamera, kSide, kSide);
  ASSERT_TRUE(again);
  EXPECT_EQ(again->rgba, first.rgba);
  other->reset();
  EXPECT_EQ(draw(scene).rgba, first.rgba) << "after the other renderer has gone";
}

}  // namespace
}  // namespace hairnet::view
