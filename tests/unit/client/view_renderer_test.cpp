#include <gmock/gmock.h>

#include <cmath>
#include <limits>
#include <numbers>

#include "client/assets/made/made.hpp"
#include "client/draw/light_rig.hpp"
#include "client/render/renderer.hpp"

namespace hairnet::render {
using namespace draw;

namespace {

// The side of most images here, px.
constexpr int kSide = 96;

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

// Returns the linear light that `with` lacks, summed over all pixels. Bytes are sRGB, and only the red ones are read. A
// white pixel counts as 1.
double light_taken(const Image& without, const Image& with) {
  const auto linear = [](int byte) { return std::pow((byte / 255.0 + 0.055) / 1.055, 2.4); };
  double sum = 0;
  for (std::size_t i = 0; i < with.rgba.size(); i += 4) sum += linear(without.rgba[i]) - linear(with.rgba[i]);
  return sum;
}

// Returns the middle of all pixels that differ between two images, px. A pixel differs if its three bytes do by more
// than 20 in sum.
Eigen::Vector2d middle_of_difference(const Image& a, const Image& b) {
  Eigen::Vector2d sum = Eigen::Vector2d::Zero();
  double weights = 0;
  for (int y = 0; y < a.height; ++y) {
    for (int x = 0; x < a.width; ++x) {
      const double weight = difference(a, b, x, y) > 20 ? 1 : 0;
      sum += weight * Eigen::Vector2d(x, y);
      weights += weight;
    }
  }
  return sum / std::max(weights, 1.0);
}

Groom bare() {
  Groom groom;
  groom.group_names = {"hair"};
  return groom;
}

void set_body(Groom& groom, const TriangleMesh& mesh) {
  groom.body.mesh = mesh;
  groom.body.bone_weights.assign(mesh.vertices.size(), {1, 0, 0, 0, 0});
}

// Makes a level strand of 0.3 m with its root on the left, at this height and depth.
Groom level_strand(float y_m = 0, float z_m = 0) {
  Groom groom = bare();
  const std::array<Vec3f, 4> strand{Vec3f(-0.15f, y_m, z_m), Vec3f(-0.05f, y_m, z_m), Vec3f(0.05f, y_m, z_m),
                                    Vec3f(0.15f, y_m, z_m)};
  groom.add_strand(strand, {.rooted = false});
  return groom;
}

// Makes a curtain of hanging strands, 0.2 m wide and 0.3 m high.
Groom curtain(std::size_t strands) {
  Groom groom = bare();
  for (std::size_t s = 0; s < strands; ++s) {
    const float x = 0.2f * (static_cast<float>(s) + 0.5f) / static_cast<float>(strands) - 0.1f;
    const std::array<Vec3f, 3> strand{Vec3f(x, 0.15f, 0), Vec3f(x, 0, 0), Vec3f(x, -0.15f, 0)};
    groom.add_strand(strand, {.rooted = false});
  }
  return groom;
}

class ViewRenderer : public testing::Test {
 protected:
  void SetUp() override {
    auto made = Renderer::create();
    if (!made && made.error().starts_with("no off-screen OpenGL ES 3")) GTEST_SKIP() << "NOT TESTED: " << made.error();
    ASSERT_TRUE(made) << made.error();
    renderer_ = std::move(*made);
    // Follow hairs stray from their strand, and tests look where strands are.
    detail_.follow_hair_count = 0;
  }
  Image draw(std::span<const ShownCharacter> characters) {
    auto image = renderer_->draw(characters, kCamera, {}, kSide, kSide);
    EXPECT_TRUE(image) << image.error();
    return image ? std::move(*image) : Image{};
  }
  ShownCharacter shown(const Groom& groom) {
    ShownCharacter character;
    character.groom = renderer_->stage().add_groom(groom);
    character.detail = detail_;
    return character;
  }
  Image draw(const Groom& groom) {
    const ShownCharacter character = shown(groom);
    return draw(std::span(&character, 1));
  }
  Image draw_nothing() { return draw(std::span<const ShownCharacter>{}); }
  // Returns how much of the background hair covers. With an exposure of 0 all hair is black, so the light that it takes
  // is what it covers.
  double covered(const ShownCharacter& character, const Camera& camera = kCamera) {
    Look dark;
    dark.exposure = 0;
    const auto image = renderer_->draw(std::span(&character, 1), camera, dark, kSide, kSide);
    EXPECT_TRUE(image);
    return light_taken(draw_nothing(), *image);
  }

  std::unique_ptr<Renderer> renderer_;
  DrawDetail detail_;
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
  EXPECT_EQ(draw(bare()).rgba, image.rgba) << "a character of nothing";
}

TEST_F(ViewRenderer, shows_a_red_sphere_where_it_stands) {
  Groom groom = bare();
  set_body(groom, sphere({0.1f, 0.05f, 0}, 0.06f));
  ShownCharacter character = shown(groom);
  character.skin_colour = Vec3f(0.8f, 0.02f, 0.02f);
  const Image image = draw(std::span(&character, 1)), empty = draw_nothing();
  for (int y = 0; y < kSide; ++y) {
    for (int x = 0; x < kSide; ++x) {
      const float dx = (static_cast<float>(x) + 0.5f - static_cast<float>(column_of(0.1f))) * 0.5f / kSide;
      const float dy = (static_cast<float>(y) + 0.5f - static_cast<float>(row_of(0.05f))) * 0.5f / kSide;
      const float away = std::hypot(dx, dy);
      // The sphere has a radius of 0.06 m. The 0.015 m on each side of its edge, three pixels, are left to antialiasing
      // and perspective.
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
  const Image image = draw(level_strand()), empty = draw_nothing();
  for (int x = 0; x < kSide; ++x) {
    const int middle = difference(image, empty, x, row_of(0)) + difference(image, empty, x, row_of(0) - 1);
    // A strand becomes thinner towards its tip (strand.vert), so its last part may be too faint to count.
    if (x > column_of(-0.14f) && x < column_of(0.06f)) {
      EXPECT_GT(middle, 40) << x;
    }
    for (int y = 0; y < kSide; ++y) {
      if (std::abs(y - row_of(0)) > 4 || x < column_of(-0.16f) || x > column_of(0.16f)) {
        EXPECT_EQ(difference(image, empty, x, y), 0) << x << ' ' << y;
      }
    }
  }
}

TEST_F(ViewRenderer, turns_width_below_a_pixel_into_coverage) {
  const ShownCharacter character = shown(curtain(100));
  const auto covered_at = [&](double distance_m) {
    Camera camera = kCamera;
    camera.eye.z() = distance_m;
    return covered(character, camera);
  };
  // The strands are 3.4 mm wide. At 1 m this is 1.3 of the pixels in which samples are taken, and at 4 m a third of
  // one. The area of the curtain falls as 1 / distance^2, and so must what it covers, within about a third.
  const double near = covered_at(1), far = covered_at(2), further = covered_at(4);
  EXPECT_GT(near, 20);
  EXPECT_NEAR(far, near / 4, 0.3 * near / 4);
  EXPECT_NEAR(further, near / 16, 0.35 * near / 16);
}

TEST_F(ViewRenderer, covers_about_as_much_with_fewer_strands_as_with_all) {
  ShownCharacter character = shown(curtain(400));
  character.detail->follow_hair_count = 2;
  const double all = covered(character);
  // With fewer strands each is drawn wider, or hair would seem to thin out in the distance.
  character.detail->strand_share = 0.3f;
  const double few = covered(character);
  EXPECT_NEAR(few, all, 0.25 * all);
}

TEST_F(ViewRenderer, shows_follow_hairs_beside_their_strand) {
  Camera camera = kCamera;
  // A pixel is now 0.2 mm, and follow hairs stray up to 2.5 mm from their strand (kStray_m in character_records.cpp).
  camera.fov_deg /= 25;
  ShownCharacter character = shown(level_strand());
  const auto height_covered_px = [&] {
    const auto image = renderer_->draw(std::span(&character, 1), camera, {}, kSide, kSide);
    const auto empty = renderer_->draw({}, camera, {}, kSide, kSide);
    int low = kSide, high = 0;
    for (int y = 0; y < kSide; ++y) {
      for (int x = 0; x < kSide; ++x) {
        if (difference(*image, *empty, x, y) < 20) continue;
        low = std::min(low, y);
        high = std::max(high, y);
      }
    }
    return high - low;
  };
  const int alone = height_covered_px();
  // With more follow hairs each is thinner than the strand was alone, so the covered height grows only because they lie
  // beside it.
  character.detail->follow_hair_count = 15;
  EXPECT_GT(alone, 0);
  EXPECT_GT(height_covered_px(), alone + 1);
}

TEST_F(ViewRenderer, draws_cards) {
  Groom groom = bare();
  for (int i = 0; i < 12; ++i) {
    const float x = -0.12f + 0.02f * static_cast<float>(i);
    groom.add_card(std::array{Vec3f(x, 0.1f, 0.05f), Vec3f(x + 0.025f, 0.1f, 0.05f), Vec3f(x, -0.1f, 0.05f),
                              Vec3f(x + 0.025f, -0.1f, 0.05f), Vec3f(x, -0.2f, 0.05f), Vec3f(x + 0.025f, -0.2f, 0.05f)},
                   {});
  }
  const Image empty = draw_nothing();
  ShownCharacter character = shown(groom);
  const Image cards = draw(std::span(&character, 1));
  EXPECT_GT(difference(cards, empty, column_of(0.01f), row_of(0)), 60);
  EXPECT_EQ(difference(cards, empty, column_of(0.2f), row_of(0)), 0);
}

TEST_F(ViewRenderer, shades_skin_that_lies_under_hair) {
  Groom groom = bare();
  set_body(groom, sphere({0, 0, 0}, 0.08f));
  const Image bald = draw(groom);
  // A curtain of many hairs hangs before the left half of the ball, and one hair behind it.
  groom.add_strand(std::array<Vec3f, 2>{Vec3f(0.1f, -0.1f, -0.1f), Vec3f(0.1f, 0.1f, -0.1f)}, {.rooted = false});
  for (int i = 0; i < 4000; ++i) {
    const float x = -0.02f - 0.06f * static_cast<float>(i % 97) / 97,
                z = 0.10f + 0.02f * static_cast<float>(i % 89) / 89;
    const std::array<Vec3f, 3> strand{Vec3f(x, 0.12f, z), Vec3f(x, 0, z), Vec3f(x, -0.12f, z)};
    groom.add_strand(strand, {.rooted = false});
  }
  ShownCharacter character = shown(groom);
  // The hair itself is not drawn, so only its shade on the skin is seen.
  character.detail->strand_share = 1e-6f;
  const Image shaded = draw(std::span(&character, 1));
  const int left = pixel(bald, column_of(-0.05f), row_of(0))[0] - pixel(shaded, column_of(-0.05f), row_of(0))[0];
  // The shade takes more than 8 of 255 steps of red.
  EXPECT_GT(left, 8);
}

// The depth test must decide, and not the order of the list.
TEST_F(ViewRenderer, hides_the_further_character_behind_the_nearer_in_either_order) {
  Groom back = bare(), front = bare();
  set_body(back, sphere({0, 0, -0.2f}, 0.06f));
  set_body(front, sphere({0, 0, 0.1f}, 0.06f));
  std::array<ShownCharacter, 2> both{shown(back), shown(front)};
  both[0].skin_colour = Vec3f(0.02f, 0.02f, 0.8f);
  both[1].skin_colour = Vec3f(0.8f, 0.02f, 0.02f);
  const Image one = draw(both);
  std::swap(both[0], both[1]);
  EXPECT_EQ(draw(both).rgba, one.rgba);
  const auto middle = pixel(one, kSide / 2, kSide / 2);
  EXPECT_GT(middle[0], 2 * middle[2]);
}

TEST_F(ViewRenderer, draws_hair_where_the_pose_and_the_lattice_put_it) {
  const Image empty = draw_nothing();
  ShownCharacter character = shown(level_strand());
  EXPECT_NEAR(middle_of_difference(draw(std::span(&character, 1)), empty).y(), row_of(0), 2);
  character.pose = rigid_pose({Quat::Identity(), Vec3(0, 0.1, 0)});
  EXPECT_NEAR(middle_of_difference(draw(std::span(&character, 1)), empty).y(), row_of(0.1f), 2);

  LevelGeometry geometry;
  geometry.lattice = {Vec3f(-0.2f, -0.2f, -0.2f), Vec3f(0.1f, 0.1f, 0.1f), {5, 5, 5}};
  // All nodes move down by 0.15 m in head space, so the strand at 0.1 m is drawn at -0.05 m.
  const std::vector<Vec3f> down(geometry.lattice.node_count(), Vec3f(0, -0.15f, 0));
  character.lattice = {&geometry, down};
  EXPECT_NEAR(middle_of_difference(draw(std::span(&character, 1)), empty).y(), row_of(-0.05f), 2);
  // Upside down, down of the head is up.
  character.pose = rigid_pose({Quat(Eigen::AngleAxisd(std::numbers::pi, Vec3::UnitZ())), Vec3(0, 0, 0)});
  EXPECT_NEAR(middle_of_difference(draw(std::span(&character, 1)), empty).y(), row_of(0.15f), 2);
}

TEST_F(ViewRenderer, draws_stretched_hair_no_longer_than_it_was_made) {
  ShownCharacter character = shown(level_strand());
  const Image empty = draw_nothing(), still = draw(std::span(&character, 1));
  LevelGeometry geometry;
  geometry.lattice = {Vec3f(-0.2f, -0.2f, -0.2f), Vec3f(0.1f, 0.1f, 0.1f), {5, 5, 5}};
  // `stretch` makes all hair 1.6 times as long along x, from its root on, and `press` 0.7 times.
  std::vector<Vec3f> stretch, press;
  for (std::uint32_t n = 0; n < geometry.lattice.node_count(); ++n) {
    stretch.emplace_back(0.6f * (geometry.lattice.node(n).x() + 0.15f), 0, 0);
    press.push_back(-0.5f * stretch.back());
  }
  character.lattice = {&geometry, stretch};
  // Without a limit of the strand's length its tip would be drawn 0.18 m further out.
  const Image stretched = draw(std::span(&character, 1));
  for (int x = 0; x < kSide; ++x) EXPECT_LT(difference(still, stretched, x, row_of(0)), 20) << x;
  // Shorter hair is drawn shorter.
  character.lattice.grid_displacements = press;
  const Image pressed = draw(std::span(&character, 1));
  EXPECT_GT(difference(still, empty, column_of(0.1f), row_of(0)), 20);
  EXPECT_LT(difference(pressed, empty, column_of(0.1f), row_of(0)), 20);
}

// The scene is a ball behind a curtain of many short segments. Light is followed through the hair as it lies when
// `quadratic` is 1; with 0 the light that was traced at rest is used.
TEST_F(ViewRenderer, follows_light_past_hair_that_has_moved_aside_and_at_rest_draws_the_traced_light) {
  Groom groom = bare();
  set_body(groom, sphere({0, 0, -0.02f}, 0.06f));
  for (int s = 0; s < 800; ++s) {
    std::vector<Vec3f> strand;
    for (int i = 0; i < 21; ++i)
      strand.emplace_back(0.16f * (static_cast<float>(s) + 0.5f) / 800 - 0.08f, 0.12f - 0.012f * static_cast<float>(i),
                          0.03f + 0.07f * static_cast<float>(s % 5) / 5);
    groom.add_strand(strand, {.rooted = false});
  }
  ShownCharacter character = shown(groom);
  const auto draw_with = [&](float quadratic) {
    character.detail->quadratic = quadratic;
    return draw(std::span(&character, 1));
  };
  const Image traced = draw_with(0), followed = draw_with(1);
  // At rest, following the light must give the traced light, within 0.2 % of all that hair and ball take.
  EXPECT_LT(std::abs(light_taken(traced, followed)), 0.002 * std::abs(light_taken(followed, draw_nothing())));

  LevelGeometry geometry;
  geometry.lattice = {Vec3f(-0.2f, -0.2f, -0.2f), Vec3f(0.1f, 0.1f, 0.1f), {5, 5, 5}};
  // The hair moves 0.3 m to the side, off the ball. Light that is not followed would still leave the ball in shade.
  const std::vector<Vec3f> aside(geometry.lattice.node_count(), Vec3f(0.3f, 0, 0));
  character.lattice = {&geometry, aside};
  const auto brightness = [&](const Image& image) {
    const auto [r, g, b] = pixel(image, column_of(0), row_of(0.01f));
    return r + g + b;
  };
  EXPECT_GT(brightness(draw_with(1)), brightness(draw_with(0)) + 60);
}

TEST_F(ViewRenderer, is_as_exact_kilometres_from_the_origin) {
  ShownCharacter character = shown(level_strand());
  const Image here = draw(std::span(&character, 1));
  // These are powers of two, so that adding them in double rounds nothing. In float, the coordinates would have steps
  // of 0.5 mm.
  const Vec3 away(4096, -2048, 1024);
  character.pose = rigid_pose({Quat::Identity(), away});
  Camera camera = kCamera;
  camera.eye += away;
  camera.target += away;
  const auto there = renderer_->draw(std::span(&character, 1), camera, {}, kSide, kSide);
  ASSERT_TRUE(there);
  EXPECT_EQ(there->rgba, here.rgba);
}

// Draw calls cost processor time, so a crowd is drawn as instances of one groom.
TEST_F(ViewRenderer, draws_a_crowd_of_one_groom_in_as_many_calls_as_one_character) {
  const Groom groom = *make_hairstyle("bob", {.strand_count = 300});
  const ShownCharacter one = shown(groom);
  draw(std::span(&one, 1));
  const StageStatistics alone = renderer_->stage().statistics();
  EXPECT_GT(alone.draw_calls, 0u);
  EXPECT_GT(alone.character_bytes, 0u);
  EXPECT_GT(alone.point_bytes, 0u);
  std::vector<ShownCharacter> crowd(20, one);
  for (std::size_t i = 0; i < crowd.size(); ++i)
    crowd[i].pose = rigid_pose({Quat::Identity(), Vec3(0.02 * static_cast<double>(i) - 0.2, 0, 0)});
  draw(crowd);
  const StageStatistics many = renderer_->stage().statistics();
  EXPECT_EQ(many.draw_calls, alone.draw_calls);
  EXPECT_EQ(many.strands, 20 * alone.strands);
  EXPECT_EQ(many.groom_bytes, alone.groom_bytes);
}

TEST_F(ViewRenderer, does_not_draw_what_is_out_of_sight) {
  ShownCharacter character = shown(level_strand());
  // The character stands 4 m behind the camera.
  character.pose = rigid_pose({Quat::Identity(), Vec3(0, 0, 5)});
  EXPECT_EQ(draw(std::span(&character, 1)).rgba, draw_nothing().rgba);
  draw(std::span(&character, 1));
  EXPECT_EQ(renderer_->stage().statistics().draw_calls, 0u);
}

TEST_F(ViewRenderer, hides_a_body_that_is_not_to_be_shown) {
  Groom groom = level_strand();
  set_body(groom, sphere({0, 0.12f, 0}, 0.06f));
  ShownCharacter character = shown(groom);
  character.body_shown = false;
  const Image image = draw(std::span(&character, 1)), empty = draw_nothing();
  EXPECT_EQ(difference(image, empty, column_of(0), row_of(0.12f)), 0);
  EXPECT_GT(difference(image, empty, column_of(-0.05f), row_of(0)) +
                difference(image, empty, column_of(-0.05f), row_of(0) - 1),
            40);
}

Groom square_cloth(float opacity) {
  Groom groom = bare();
  const std::array<Vec3f, 4> corners{Vec3f(-0.1f, -0.1f, 0), Vec3f(0.1f, -0.1f, 0), Vec3f(0.1f, 0.1f, 0),
                                     Vec3f(-0.1f, 0.1f, 0)};
  Cloth cloth;
  cloth.triangles = {{0, 1, 2}, {0, 2, 3}};
  cloth.colour = Vec3f(0.02f, 0.5f, 0.02f);
  cloth.opacity = opacity;
  groom.add_cloth(corners, cloth);
  return groom;
}

TEST_F(ViewRenderer, shows_cloth_from_both_sides) {
  const Groom groom = square_cloth(1);
  ShownCharacter character = shown(groom);
  for (const double angle : {0.0, std::numbers::pi}) {
    character.pose = rigid_pose({Quat(Eigen::AngleAxisd(angle, Vec3::UnitY())), Vec3::Zero()});
    const auto [r, g, b] = pixel(draw(std::span(&character, 1)), kSide / 2, kSide / 2);
    EXPECT_GT(g, 2 * r) << angle;
    EXPECT_GT(g, 2 * b) << angle;
  }
}

TEST_F(ViewRenderer, lets_sight_through_thin_cloth) {
  const double thick = covered(shown(square_cloth(1)));
  for (const float opacity : {0.2f, 0.4f, 0.7f}) {
    const double thin = covered(shown(square_cloth(opacity)));
    EXPECT_NEAR(thin, static_cast<double>(opacity) * thick, 0.08 * thick) << opacity;
  }
}

TEST_F(ViewRenderer, shows_threads_in_their_colour) {
  Groom groom = bare();
  const std::array<Vec3f, 2> line{Vec3f(0, -0.1f, 0), Vec3f(0, 0.1f, 0)};
  Thread thread;
  thread.radius_m = 0.01f;
  thread.colour = Vec3f(0.02f, 0.02f, 0.6f);
  groom.add_thread(line, thread);
  const Image image = draw(groom), empty = draw_nothing();
  const auto middle = pixel(image, kSide / 2, kSide / 2);
  EXPECT_GT(middle[2], 2 * middle[0]);
  EXPECT_EQ(difference(image, empty, column_of(0.02f), row_of(0)), 0);
}

// Makes a hair card of 0.1 m width that reaches from this height down to -0.15 m.
Groom card_from(float top_m) {
  Groom groom = bare();
  const std::array<Vec3f, 6> edges{Vec3f(-0.05f, top_m, 0), Vec3f(0.05f, top_m, 0),   Vec3f(-0.05f, 0, 0),
                                   Vec3f(0.05f, 0, 0),      Vec3f(-0.05f, -0.15f, 0), Vec3f(0.05f, -0.15f, 0)};
  groom.add_card(edges, {.rooted = false});
  return groom;
}

TEST_F(ViewRenderer, shows_a_grooms_own_cards_in_the_hairs_colour) {
  const Groom groom = card_from(0.1f);
  ShownCharacter character = shown(groom);
  character.hair_colour = Vec3f(0.5f, 0.03f, 0.02f);
  const Image image = draw(std::span(&character, 1)), empty = draw_nothing();
  // The card of 0.1 m by 0.25 m covers 920 of the 96 x 96 pixels, each of which counts by the light of the
  // background.
  EXPECT_GT(covered(character), 200);
  EXPECT_EQ(difference(image, empty, column_of(0.1f), row_of(0)), 0);
  int reddish = 0;
  for (int x = column_of(-0.04f); x < column_of(0.04f); ++x) {
    const auto [r, g, b] = pixel(image, x, row_of(0.03f));
    reddish += r > b + 20 ? 1 : 0;
  }
  EXPECT_GT(reddish, 6);
}

TEST_F(ViewRenderer, shows_hair_in_one_colour_at_the_root_and_another_at_the_tip) {
  const Groom groom = card_from(0.15f);
  ShownCharacter character = shown(groom);
  character.hair_colour = Vec3f(0.6f, 0.02f, 0.02f);
  character.hair_tip_colour = Vec3f(0.02f, 0.02f, 0.6f);
  const Image image = draw(std::span(&character, 1));
  int red_above = 0, blue_below = 0;
  for (int x = column_of(-0.04f); x < column_of(0.04f); ++x) {
    const auto above = pixel(image, x, row_of(0.1f)), below = pixel(image, x, row_of(-0.12f));
    red_above += above[0] > above[2] + 20 ? 1 : 0;
    blue_below += below[2] > below[0] + 20 ? 1 : 0;
  }
  EXPECT_GT(red_above, 6);
  EXPECT_GT(blue_below, 6);
}

TEST_F(ViewRenderer, rougher_hair_looks_different) {
  ShownCharacter character = shown(level_strand());
  const Image usual = draw(std::span(&character, 1));
  character.roughness = 1;
  EXPECT_NE(draw(std::span(&character, 1)).rgba, usual.rgba);
}

TEST_F(ViewRenderer, leaves_out_characters_at_invalid_places) {
  const Image empty = draw_nothing();
  ShownCharacter character = shown(level_strand());
  // A pose of a stranger may hold any number, and must not spoil the image of all others.
  for (const double x : {std::numeric_limits<double>::quiet_NaN(), std::numeric_limits<double>::infinity(), 1e9}) {
    character.pose = rigid_pose({Quat::Identity(), Vec3(x, 0, 0)});
    EXPECT_EQ(draw(std::span(&character, 1)).rgba, empty.rgba) << x;
  }
  character.pose = Pose{};
  character.groom = 77;
  EXPECT_EQ(draw(std::span(&character, 1)).rgba, empty.rgba) << "no such groom";
}

TEST_F(ViewRenderer, forgets_a_removed_groom_and_takes_another_in_its_place) {
  const ShownCharacter character = shown(level_strand());
  const Image before = draw(std::span(&character, 1));
  renderer_->stage().remove_groom(character.groom);
  EXPECT_EQ(draw(std::span(&character, 1)).rgba, draw_nothing().rgba);
  EXPECT_EQ(shown(level_strand()).groom, character.groom);
  EXPECT_EQ(draw(std::span(&character, 1)).rgba, before.rgba);
}

TEST_F(ViewRenderer, refuses_sizes_out_of_range_and_draws_the_next_picture) {
  for (const auto& [width, height] : {std::pair{0, 10}, {10, -1}, {kPictureSideMax + 1, 10}}) {
    EXPECT_FALSE(renderer_->draw({}, kCamera, {}, width, height)) << width;
  }
  // Renderer::create() takes 1 to 4 samples along the side of a pixel.
  EXPECT_FALSE(Renderer::create(0));
  EXPECT_FALSE(Renderer::create(5));
  const auto image = renderer_->draw({}, kCamera, {}, 7, 13);
  ASSERT_TRUE(image) << image.error();
  EXPECT_EQ(image->rgba.size(), 4u * 7 * 13);
}

TEST_F(ViewRenderer, gives_the_same_picture_again_and_from_another_renderer) {
  const Groom groom = *make_hairstyle("bob", {.strand_count = 400});
  const Image first = draw(groom);
  EXPECT_EQ(draw(groom).rgba, first.rgba);
  renderer_ = std::move(*Renderer::create());
  EXPECT_EQ(draw(groom).rgba, first.rgba);
}

// The lights go along with the camera, so that the face that is looked at is never in the dark.
TEST(LightRig, lights_from_where_the_camera_stands) {
  for (const Vec3& eye : {Vec3(0, 0, 1), Vec3(1, 0, 0), Vec3(0, 0, -1)}) {
    const LightRig rig = studio_lights({eye, {0, 0, 0}, {0, 1, 0}, 30});
    EXPECT_GT(rig.towards[0].cast<double>().dot(eye), 0.3) << "key before";
    EXPECT_LT(rig.towards[0].cast<double>().dot(Vec3::UnitY().cross(eye)), 0) << "key at the left";
    EXPECT_GT(rig.towards[0].y(), 0.5f) << "key above";
    EXPECT_LT(rig.towards[2].cast<double>().dot(eye), -0.3) << "rim behind";
    for (const Vec3f& towards : rig.towards) EXPECT_NEAR(towards.norm(), 1, 1e-5f);
  }
  for (const Vec3f& towards : studio_lights({{0, 1, 0}, {0, 0, 0}, {0, 1, 0}, 30}).towards)
    EXPECT_NEAR(towards.norm(), 1, 1e-5f) << "straight down";
}

}  // namespace
}  // namespace hairnet::render
