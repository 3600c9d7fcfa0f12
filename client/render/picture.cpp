#include "client/render/picture.hpp"

#include <cmath>
#include <utility>
#include <vector>

#include "client/render/projection.hpp"

namespace hairnet::render {
namespace {

// The number of samples for each pixel: OpenGL ES 3 guarantees no more.
constexpr GLsizei kSamples = 4;
// The shifts of place_of() repeat after this many pictures. The average has no more pictures either (accumulate.frag).
constexpr int kPlaces = 32;
// A camera that turns or moves further than this between two pictures shows something else: the average ends. Most
// pixels could not be found in the last picture.
constexpr double kCut_rad = 0.6, kCut_m = 1;

void make_texture(Texture& texture, GLint unit, GLenum format, GLint filter, int width, int height) {
  // Storage is immutable: a new size needs a new name.
  texture = Texture();
  glActiveTexture(GL_TEXTURE0 + static_cast<GLenum>(unit));
  glBindTexture(GL_TEXTURE_2D, texture.name());
  glTexStorage2D(GL_TEXTURE_2D, 1, format, width, height);
  for (const GLenum which : {GL_TEXTURE_MIN_FILTER, GL_TEXTURE_MAG_FILTER})
    glTexParameteri(GL_TEXTURE_2D, which, filter);
  for (const GLenum which : {GL_TEXTURE_WRAP_S, GL_TEXTURE_WRAP_T})
    glTexParameteri(GL_TEXTURE_2D, which, GL_CLAMP_TO_EDGE);
}

void make_samples(const Renderbuffer& buffer, GLenum format, GLenum attachment, int width, int height) {
  glBindRenderbuffer(GL_RENDERBUFFER, buffer.name());
  glRenderbufferStorageMultisample(GL_RENDERBUFFER, kSamples, format, width, height);
  glFramebufferRenderbuffer(GL_FRAMEBUFFER, attachment, GL_RENDERBUFFER, buffer.name());
}

void attach(GLenum attachment, const Texture& texture) {
  glFramebufferTexture2D(GL_FRAMEBUFFER, attachment, GL_TEXTURE_2D, texture.name(), 0);
}

bool is_complete() {
  return glCheckFramebufferStatus(GL_FRAMEBUFFER) == GL_FRAMEBUFFER_COMPLETE;
}

void bind(GLint unit, GLenum kind, const Texture& texture) {
  glActiveTexture(GL_TEXTURE0 + static_cast<GLenum>(unit));
  glBindTexture(kind, texture.name());
}

bool is_cut(const draw::Camera& before, const draw::Camera& now) {
  const Vec3 forward_before = (before.target - before.eye).normalized(), forward = (now.target - now.eye).normalized();
  return forward_before.dot(forward) < std::cos(kCut_rad) || (now.eye - before.eye).norm() > kCut_m;
}

// The matrices are doubles, since the camera may be kilometres from the origin; only their products become floats.
Eigen::Matrix4d transform(const Eigen::Matrix3d& rotation, const Vec3& position) {
  Eigen::Matrix4d m = Eigen::Matrix4d::Identity();
  m.topLeftCorner<3, 3>() = rotation;
  m.topRightCorner<3, 1>() = position;
  return m;
}

// Maps head space to the world's axes, with `origin` as the origin.
Eigen::Matrix4d transform(const RigidTransform& head, float scale, const Vec3& origin) {
  return transform(static_cast<double>(scale) * head.rotation.toRotationMatrix(), head.position - origin);
}

// Mirrors the digits of n in that base about the point.
float radical_inverse(int n, int base) {
  float inverse = 0, digit = 1 / static_cast<float>(base);
  for (int left = n; left > 0; left /= base, digit /= static_cast<float>(base))
    inverse += digit * static_cast<float>(left % base);
  return inverse;
}

}  // namespace

std::array<float, 2> place_of(int number) {
  // The sequence begins at 1, since 0 would lie in the corner.
  const int n = number % kPlaces + 1;
  return {radical_inverse(n, 2) - 0.5f, radical_inverse(n, 3) - 0.5f};
}

Result<Picture> Picture::build() {
  auto programs = build_programs(
      {{"screen.vert", "accumulate.frag"}, {"screen.vert", "present.frag"}, {"screen.vert", "depths.frag"}});
  if (!programs) return Refusal(programs.error());
  auto& [accumulate, present, depths] = *programs;
  return Picture(std::move(accumulate), std::move(present), std::move(depths));
}

void Picture::cut() {
  before_.reset();
  motion_.forget();
  number_ = 0;
}

// Makes the targets for a size. Returns false when the GPU cannot; then it tries again when the size changes.
bool Picture::resize(int width, int height) {
  if (width == width_ && height == height_) return has_targets_;
  cut();
  width_ = width;
  height_ = height;
  // Errors of other code, which must not count as this one's.
  while (glGetError() != GL_NO_ERROR) {
  }
  glBindFramebuffer(GL_FRAMEBUFFER, samples_target_.name());
  make_samples(colour_samples_, GL_RGBA8, GL_COLOR_ATTACHMENT0, width, height);
  make_samples(depth_samples_, GL_DEPTH_COMPONENT24, GL_DEPTH_ATTACHMENT, width, height);
  has_targets_ = is_complete();
  make_texture(current_, kCurrentUnit, GL_RGBA8, GL_NEAREST, width, height);
  make_texture(depth_, kDepthUnit, GL_DEPTH_COMPONENT24, GL_NEAREST, width, height);
  glBindFramebuffer(GL_FRAMEBUFFER, current_target_.name());
  attach(GL_COLOR_ATTACHMENT0, current_);
  attach(GL_DEPTH_ATTACHMENT, depth_);
  has_targets_ = has_targets_ && is_complete();
  for (Average* average : {&next_, &last_}) {
    // Half floats: bytes would round away what one picture adds to an average of 32.
    make_texture(average->colour, kHistoryUnit, GL_RGBA16F, GL_LINEAR, width, height);
    make_texture(average->count, kHistoryCountUnit, GL_R16F, GL_NEAREST, width, height);
    glBindFramebuffer(GL_FRAMEBUFFER, average->target.name());
    attach(GL_COLOR_ATTACHMENT0, average->colour);
    attach(GL_COLOR_ATTACHMENT1, average->count);
    constexpr std::array<GLenum, 2> kBoth{GL_COLOR_ATTACHMENT0, GL_COLOR_ATTACHMENT1};
    glDrawBuffers(2, kBoth.data());
    has_targets_ = has_targets_ && is_complete();
  }
  // A lack of memory shows as an error, not as an incomplete target.
  while (glGetError() != GL_NO_ERROR) has_targets_ = false;
  return has_targets_;
}

void Picture::draw(Stage& stage, std::span<const draw::ShownCharacter> characters, const draw::Camera& wanted,
                   const Look& look, int width, int height) {
  if (width < 1 || height < 1) return;
  GLint screen = 0;
  glGetIntegerv(GL_FRAMEBUFFER_BINDING, &screen);
  if (!resize(width, height)) {
    glBindFramebuffer(GL_FRAMEBUFFER, static_cast<GLuint>(screen));
    stage.draw(characters, wanted, look, width, height, false, {});
    return;
  }
  const draw::Camera camera = sanitized(wanted);
  if (before_ && is_cut(before_->camera, camera)) cut();
  // Each picture has four samples a pixel, which spread over the pixel already. So half of the shift suffices: the
  // samples of all pictures together then cover the pixel evenly.
  const auto [x_px, y_px] = place_of(number_);
  const Sampling sampling{0.5f * x_px / static_cast<float>(width), 0.5f * y_px / static_cast<float>(height), number_};
  glBindFramebuffer(GL_FRAMEBUFFER, samples_target_.name());
  stage.draw(characters, camera, look, width, height, false, sampling);
  // Multisampled targets cannot be read by a shader, so they are resolved first.
  glBindFramebuffer(GL_READ_FRAMEBUFFER, samples_target_.name());
  glBindFramebuffer(GL_DRAW_FRAMEBUFFER, current_target_.name());
  glBlitFramebuffer(0, 0, width, height, 0, 0, width, height, GL_COLOR_BUFFER_BIT | GL_DEPTH_BUFFER_BIT, GL_NEAREST);

  const float aspect = static_cast<float>(width) / static_cast<float>(height);
  const draw::DepthRange range = stage.depth_range();
  // The camera is the origin of scene space, so the matrix has its rotation but not its place.
  const CameraBefore now{camera, perspective(camera, aspect, range.near_m, range.far_m).cast<double>() *
                                     transform(view_rotation(camera), Vec3::Zero())};
  accumulate_.use();
  set_uniforms(stage, now, sampling);
  bind(kCurrentUnit, GL_TEXTURE_2D, current_);
  bind(kDepthUnit, GL_TEXTURE_2D, depth_);
  bind(kHistoryUnit, GL_TEXTURE_2D, last_.colour);
  bind(kHistoryCountUnit, GL_TEXTURE_2D, last_.count);
  bind(kSwingUnit, GL_TEXTURE_3D, swing_);
  glDisable(GL_DEPTH_TEST);
  glBindFramebuffer(GL_FRAMEBUFFER, next_.target.name());
  draw_screen();
  present_.use();
  // The new average is shown, and is the last one in the next picture.
  bind(kHistoryUnit, GL_TEXTURE_2D, next_.colour);
  glBindFramebuffer(GL_FRAMEBUFFER, static_cast<GLuint>(screen));
  draw_screen();
  glActiveTexture(GL_TEXTURE0);
  std::swap(next_, last_);
  before_ = now;
  ++number_;
}

// Sets where each pixel was in the last picture. Scene space has the camera as its origin, where floats are precise.
void Picture::set_uniforms(const Stage& stage, const CameraBefore& now, const Sampling& sampling) {
  const Vec3& eye = now.camera.eye;
  Eigen::Matrix4d shift = Eigen::Matrix4d::Identity();
  // The depths were drawn with the shift, so the way back to the scene must have it, too.
  shift(0, 3) = 2 * static_cast<double>(sampling.shift_x);
  shift(1, 3) = 2 * static_cast<double>(sampling.shift_y);
  accumulate_.set("jitter", sampling.shift_x, sampling.shift_y);
  accumulate_.set("to_scene", Mat4f((shift * now.to_clip).inverse().cast<float>()));
  // Without a picture before, everything was outside of it: a matrix of zeros puts each place there.
  Eigen::Matrix4d to_clip_before = Eigen::Matrix4d::Zero();
  if (before_) to_clip_before = before_->to_clip * transform(Eigen::Matrix3d::Identity(), eye - before_->camera.eye);
  accumulate_.set("to_clip_before", Mat4f(to_clip_before.cast<float>()));

  // Call it for each picture, also the first: it remembers the nodes.
  const std::vector<draw::HairMotion::Motion> motions = motion_.motions(stage.drawn_characters());
  std::vector<Mat4f> to_head, head_to_clip_before;
  std::vector<float> radius_m;
  for (const draw::HairMotion::Motion& one : motions) {
    to_head.emplace_back(transform(one.head, one.scale, eye).inverse().cast<float>());
    head_to_clip_before.emplace_back(
        (before_->to_clip * transform(one.head_before, one.scale_before, before_->camera.eye)).cast<float>());
    radius_m.push_back(one.ball_radius_m);
  }
  accumulate_.set("moving_count", static_cast<int>(motions.size()));
  // The shader then reads no arrays, which keep their old values.
  if (motions.empty()) return;
  accumulate_.set("to_head", std::span<const Mat4f>(to_head));
  accumulate_.set("head_to_clip_before", std::span<const Mat4f>(head_to_clip_before));
  accumulate_.set("radius_m", std::span<const float>(radius_m));
  fill_swing();
}

void Picture::fill_swing() {
  constexpr auto kSide = static_cast<GLsizei>(draw::HairMotion::kSwingNodes);
  constexpr auto kDepth = static_cast<GLsizei>(draw::HairMotion::kSwingNodes * draw::HairMotion::kMovingMax);
  bind(kSwingUnit, GL_TEXTURE_3D, swing_);
  // The size never changes, so storage is made once.
  if (!std::exchange(has_swing_, true)) {
    glTexStorage3D(GL_TEXTURE_3D, 1, GL_RGBA16F, kSide, kSide, kDepth);
    for (const GLenum which : {GL_TEXTURE_MIN_FILTER, GL_TEXTURE_MAG_FILTER})
      glTexParameteri(GL_TEXTURE_3D, which, GL_LINEAR);
    for (const GLenum which : {GL_TEXTURE_WRAP_S, GL_TEXTURE_WRAP_T, GL_TEXTURE_WRAP_R})
      glTexParameteri(GL_TEXTURE_3D, which, GL_CLAMP_TO_EDGE);
  }
  glTexSubImage3D(GL_TEXTURE_3D, 0, 0, 0, 0, kSide, kSide, kDepth, GL_RGBA, GL_FLOAT, motion_.swing().data());
}

void Picture::draw_screen() const {
  glViewport(0, 0, width_, height_);
  glBindVertexArray(nothing_.name());
  glDrawArrays(GL_TRIANGLES, 0, 3);
  glBindVertexArray(0);
}

void Picture::copy_depths() const {
  // The stage has drawn the depths into the bound framebuffer itself.
  if (!has_targets_) return;
  depths_.use();
  bind(kDepthUnit, GL_TEXTURE_2D, depth_);
  glColorMask(GL_FALSE, GL_FALSE, GL_FALSE, GL_FALSE);
  glEnable(GL_DEPTH_TEST);
  glDepthMask(GL_TRUE);
  // The depths are copied whatever was there.
  glDepthFunc(GL_ALWAYS);
  draw_screen();
  glDepthFunc(GL_LESS);
  glColorMask(GL_TRUE, GL_TRUE, GL_TRUE, GL_TRUE);
  glActiveTexture(GL_TEXTURE0);
}

}  // namespace hairnet::render
