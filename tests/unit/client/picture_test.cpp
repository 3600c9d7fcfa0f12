// Tests Picture, which shows a window the running average of several drawings. It is drawn off-screen here.
#include "client/render/picture.hpp"

#include <gmock/gmock.h>

#include <algorithm>
#include <cmath>
#include <optional>
#include <set>
#include <string>

#include "client/assets/made/made.hpp"
#include "client/render/egl_context.hpp"
#include "client/render/overlay.hpp"
#include "client/render/shader_text.hpp"

namespace hairnet::render {
using namespace draw;

namespace {

constexpr int kSide = 100;
// A reference has kFine x kFine samples a pixel, each with a coverage of its own.
constexpr int kFine = 8;

// Red, green, blue and alpha of each pixel, 0 to 255.
using Pixels = std::vector<float>;

// Returns the mean of the squared differences of two images.
double apart(const Pixels& a, const Pixels& b) {
  double sum = 0;
  for (std::size_t i = 0; i < a.size(); ++i) sum += std::pow(static_cast<double>(a[i]) - static_cast<double>(b[i]), 2);
  return sum / static_cast<double>(a.size());
}

// Stands in for the framebuffer of a window.
class Target {
 public:
  Target(int width, int height, GLsizei samples) : width_(width), height_(height) {
    glBindFramebuffer(GL_FRAMEBUFFER, framebuffer_.name());
    for (const auto& [buffer, format, attachment] :
         {std::tuple(&colour_, GL_RGBA8, GL_COLOR_ATTACHMENT0), {&depth_, GL_DEPTH_COMPONENT24, GL_DEPTH_ATTACHMENT}}) {
      glBindRenderbuffer(GL_RENDERBUFFER, buffer->name());
      glRenderbufferStorageMultisample(GL_RENDERBUFFER, samples, static_cast<GLenum>(format), width, height);
      glFramebufferRenderbuffer(GL_FRAMEBUFFER, static_cast<GLenum>(attachment), GL_RENDERBUFFER, buffer->name());
    }
    EXPECT_EQ(glCheckFramebufferStatus(GL_FRAMEBUFFER), static_cast<GLenum>(GL_FRAMEBUFFER_COMPLETE));
  }
  void bind() const { glBindFramebuffer(GL_FRAMEBUFFER, framebuffer_.name()); }
  void resolve_to(const Target& other) const {
    glBindFramebuffer(GL_READ_FRAMEBUFFER, framebuffer_.name());
    glBindFramebuffer(GL_DRAW_FRAMEBUFFER, other.framebuffer_.name());
    glBlitFramebuffer(0, 0, width_, height_, 0, 0, width_, height_, GL_COLOR_BUFFER_BIT, GL_NEAREST);
  }
  [[nodiscard]] Pixels read() const {
    bind();
    std::vector<std::uint8_t> bytes(static_cast<std::size_t>(4 * width_ * height_));
    glReadPixels(0, 0, width_, height_, GL_RGBA, GL_UNSIGNED_BYTE, bytes.data());
    EXPECT_EQ(glGetError(), static_cast<GLenum>(GL_NO_ERROR));
    return {bytes.begin(), bytes.end()};
  }

 private:
  int width_, height_;
  Framebuffer framebuffer_;
  Renderbuffer colour_, depth_;
};

// A made hairstyle by its name, and the colour of its hair in linear RGB.
struct Hair {
  const char *name, *style;
  Vec3f colour;
};
constexpr const char* kCurls = "long_curly";

class PictureTest : public testing::Test {
 protected:
  void SetUp() override {
    Result<EglContext> context = EglContext::create();
    if (!context) GTEST_SKIP() << "NOT TESTED: " << context.error();
    context_.emplace(std::move(*context));
    auto stage = Stage::create();
    ASSERT_TRUE(stage) << stage.error();
    stage_ = std::move(*stage);
    auto picture = Picture::build();
    ASSERT_TRUE(picture) << picture.error();
    picture_.emplace(std::move(*picture));
    screen_.emplace(kSide, kSide, 0);
    samples_.emplace(kSide, kSide, 4);
    look_.background_top = look_.background_bottom = {0.2f, 0.28f, 0.35f};
    camera_.eye = {0, 0.03, 0.6};
    camera_.fov_deg = 35;
  }
  void TearDown() override {
    samples_.reset();
    screen_.reset();
    picture_.reset();
    stage_.reset();
  }
  void show(const char* style, const Vec3f& colour) {
    character_.groom = stage_->add_groom(*make_hairstyle(style, {.strand_count = 1500}));
    character_.id = 1;
    character_.pose = rigid_pose({});
    character_.hair_colour = colour;
    // All strands are drawn, as thin as they are from near, which gives the most grain.
    character_.detail = DrawDetail{1, 1, 1e-3f, 1};
  }
  // Draws one more image into the average, and returns what the window shows.
  Pixels averaged(Picture& picture) {
    screen_->bind();
    picture.draw(*stage_, {&character_, 1}, camera_, look_, kSide, kSide);
    return screen_->read();
  }
  Pixels averaged() { return averaged(*picture_); }
  template <class Move>
  // Begins a new average, calls `move` with 0 to 7 before each drawing, and returns what the window shows after the
  // eighth.
  Pixels last_of_8(const Move& move) {
    picture_->cut();
    Pixels last;
    for (int n = 0; n < 8; ++n) {
      move(n);
      last = averaged();
    }
    return last;
  }
  // Returns an image without an average, with four samples a pixel.
  Pixels single(const Sampling& sampling = {}) {
    samples_->bind();
    stage_->draw({&character_, 1}, camera_, look_, kSide, kSide, false, sampling);
    samples_->resolve_to(*screen_);
    return screen_->read();
  }
  // Returns what an endless average would show: the mean of two images of 8 x 8 samples a pixel.
  Pixels reference() {
    const int side = kFine * kSide;
    const Target large(side, side, 0);
    Pixels mean(static_cast<std::size_t>(4 * kSide * kSide));
    for (const int seed : {1, 2}) {
      large.bind();
      stage_->draw({&character_, 1}, camera_, look_, side, side, false, {0, 0, seed});
      const Pixels fine = large.read();
      for (int n = 0; n < side * side; ++n) {
        const int at = n % side / kFine + kSide * (n / side / kFine);
        for (int c = 0; c < 4; ++c)
          mean[static_cast<std::size_t>(4 * at + c)] += fine[static_cast<std::size_t>(4 * n + c)] / (2 * kFine * kFine);
      }
    }
    return mean;
  }

  std::optional<EglContext> context_;
  std::unique_ptr<Stage> stage_;
  std::optional<Picture> picture_;
  std::optional<Target> screen_, samples_;
  ShownCharacter character_;
  Camera camera_;
  Look look_;
};

class PictureOfHair : public PictureTest, public testing::WithParamInterface<Hair> {};

TEST_P(PictureOfHair, of_which_16_have_less_than_a_quarter_of_the_grain_of_one) {
  show(GetParam().style, GetParam().colour);
  const Pixels wanted = reference(), one = single();
  Pixels before, last;
  for (int n = 0; n < 16; ++n) before = std::exchange(last, averaged());
  EXPECT_EQ(picture_->pictures(), 16);
  // Both numbers are shares of the mean squared error of a single drawing. `flicker` is what the window changes by
  // from the 15th drawing to the 16th.
  const double error = apart(last, wanted) / apart(one, wanted), flicker = apart(last, before) / apart(one, wanted);
  RecordProperty("error", std::to_string(error));
  RecordProperty("flicker", std::to_string(flicker));
  EXPECT_LT(error, 0.25);
  EXPECT_LT(flicker, 0.25);
}

INSTANTIATE_TEST_SUITE_P(Hair, PictureOfHair,
                         testing::Values(Hair{"dark_curls", kCurls, {0.023f, 0.010f, 0.005f}},
                                         Hair{"straight_blonde", "long_straight", {0.686f, 0.434f, 0.162f}}),
                         [](const auto& hair) { return hair.param.name; });

TEST_F(PictureTest, after_a_cut_is_the_single_picture) {
  show(kCurls, {0.1f, 0.05f, 0.03f});
  for (int n = 0; n < 5; ++n) averaged();
  // The camera goes round the head by 90 degrees, more than kCut_rad, 0.6 (picture.cpp).
  camera_.eye = {0.6, 0.03, 0};
  const Pixels after_turn = averaged();
  EXPECT_EQ(picture_->pictures(), 1);
  const auto [x_px, y_px] = place_of(0);
  // draw() shifts each drawing by half of its sample position (picture.cpp), and begins with position 0 after a cut.
  EXPECT_EQ(after_turn, single({0.5f * x_px / kSide, 0.5f * y_px / kSide, 0}));
  averaged();
  EXPECT_EQ(picture_->pictures(), 2);
  // The camera moves back by 1.4 m, more than kCut_m, 1 m.
  camera_.eye = {2, 0.03, 0};
  averaged();
  EXPECT_EQ(picture_->pictures(), 1);
  // Another size begins a new average, and so does the old size after it.
  picture_->draw(*stage_, {&character_, 1}, camera_, look_, kSide / 2, kSide);
  EXPECT_EQ(picture_->pictures(), 1);
  const Pixels after_size = averaged();
  EXPECT_EQ(after_size, single({0.5f * x_px / kSide, 0.5f * y_px / kSide, 0}));
}

TEST_F(PictureTest, follows_the_camera) {
  show(kCurls, {0.1f, 0.05f, 0.03f});
  // The camera turns by 0.006 m at a distance of 0.6 m, which is 0.01 rad or 1.6 px, from image to image.
  const auto move = [&](int n) { camera_.target.x() = 0.006 * n; };
  const Pixels last = last_of_8(move), wanted = reference();
  EXPECT_EQ(picture_->pictures(), 8);
  // The average must show what the camera sees last. An image of the camera one step earlier must err at least four
  // times as much.
  move(6);
  EXPECT_LT(apart(last, wanted), 0.25 * apart(single(), wanted));
}

TEST_F(PictureTest, follows_heads) {
  show(kCurls, {0.1f, 0.05f, 0.03f});
  const auto move = [&](int n) {
    character_.pose = rigid_pose({Quat(Eigen::AngleAxisd(0.01 * n, Vec3::UnitZ())), {0.006 * n, 0, 0}});
  };
  const Pixels followed = last_of_8(move), wanted = reference();
  // Without an id the motion is not followed, and the average smears the hair. Following must halve the error.
  character_.id = 0;
  EXPECT_LT(apart(followed, wanted), 0.5 * apart(last_of_8(move), wanted));
}

TEST_F(PictureTest, follows_hair) {
  show(kCurls, {0.1f, 0.05f, 0.03f});
  // The nodes lean sideways by 18 mm more in each drawing for each metre below the head joint, so hair swings under
  // a head that is still.
  LevelGeometry geometry;
  geometry.lattice = {{-0.3f, -0.5f, -0.3f}, {0.1f, 0.1f, 0.1f}, {7, 8, 7}};
  std::vector<Vec3f> displacements(geometry.lattice.node_count(), Vec3f::Zero());
  character_.lattice = {&geometry, displacements};
  const auto move = [&](int n) {
    for (std::uint32_t node = 0; node < displacements.size(); ++node)
      displacements[node].x() = -0.018f * static_cast<float>(n) * geometry.lattice.node(node).y();
  };
  const Pixels followed = last_of_8(move), wanted = reference();
  character_.id = 0;
  EXPECT_LT(apart(followed, wanted), 0.5 * apart(last_of_8(move), wanted));
}

TEST_F(PictureTest, draws_as_the_stage_where_there_is_no_room) {
  show(kCurls, {0.1f, 0.05f, 0.03f});
  GLint most = 0;
  glGetIntegerv(GL_MAX_TEXTURE_SIZE, &most);
  const auto drawn = [&](auto draw) {
    screen_->bind();
    glClear(GL_COLOR_BUFFER_BIT);
    draw();
    return screen_->read();
  };
  // One pixel more than the widest texture of the GPU leaves no room for the targets of an average.
  const Pixels by_picture = drawn([&] { picture_->draw(*stage_, {&character_, 1}, camera_, look_, most + 1, kSide); });
  EXPECT_EQ(picture_->pictures(), 0);
  EXPECT_EQ(by_picture, drawn([&] { stage_->draw({&character_, 1}, camera_, look_, most + 1, kSide, false, {}); }));
}

TEST_F(PictureTest, hides_overlays_behind_what_it_shows) {
  show(kCurls, {0.1f, 0.05f, 0.03f});
  auto overlay = Overlay::create();
  ASSERT_TRUE(overlay) << overlay.error();
  // The camera looks from (0, 0.03, 0.6) to the origin, so each point (0, 0.05 z, z) is in the middle of the image.
  // The function returns the green value of the pixel there.
  const auto with_point = [&](float z_m) {
    Drawing drawing;
    drawing.point({0, 0.05f * z_m, z_m}, {0, 255, 0, 255});
    averaged();
    screen_->bind();
    picture_->copy_depths();
    (*overlay)->draw(drawing, camera_, stage_->depth_range(), kSide, kSide);
    const Pixels pixels = screen_->read();
    return pixels[static_cast<std::size_t>(4 * (kSide * kSide / 2 + kSide / 2) + 1)];
  };
  // The green point is seen in front of the hair, and hidden behind it.
  EXPECT_EQ(with_point(0.3f), 255);
  EXPECT_LT(with_point(-0.3f), 200);
}

// The positions repeat after kPlaces, 32, drawings (picture.cpp). If they leaned to one side of the pixel, the whole
// image would be shifted.
TEST(PictureSampling, has_32_distinct_places_that_are_even_about_the_middle_of_the_pixel) {
  std::set<std::array<float, 2>> places;
  float sum_x = 0, sum_y = 0;
  for (int n = 0; n < 32; ++n) {
    const auto [x, y] = place_of(n);
    EXPECT_LT(std::max(std::abs(x), std::abs(y)), 0.5f);
    places.insert({x, y});
    sum_x += x / 32;
    sum_y += y / 32;
  }
  EXPECT_EQ(places.size(), 32u);
  EXPECT_LT(std::hypot(sum_x, sum_y), 0.03f);
  EXPECT_EQ(place_of(32), place_of(0));
}

// The shader repeats two numbers of HairMotion, since GLSL cannot include a C++ header.
TEST(PictureSampling, shader_has_room_for_as_many_characters_and_for_their_swing) {
  const std::string text(shader_text("accumulate.frag"));
  EXPECT_THAT(text, testing::HasSubstr("kMovingMax = " + std::to_string(HairMotion::kMovingMax) + ";"));
  EXPECT_THAT(text, testing::HasSubstr("kSwingNodes = " + std::to_string(HairMotion::kSwingNodes) + ".0;"));
}

}  // namespace
}  // namespace hairnet::render
