#include <algorithm>
#include <optional>
#include <string>

#include "client/render/egl_context.hpp"
#include "client/render/picture_target.hpp"
#include "client/render/renderer.hpp"
#include "client/render/shader_program.hpp"

namespace hairnet::render {
namespace {

// The most pixels of the large picture: 4 samples of colour and depth take 32 bytes for each of them, 1.3 GB in all.
constexpr std::int64_t kLargePixelsMax = 40'000'000;

class GlRenderer final : public Renderer {
 public:
  GlRenderer(EglContext context, int supersample) : context_(std::move(context)), supersample_(supersample) {}
  // The destructors of the members need the context.
  ~GlRenderer() override { static_cast<void>(context_.make_current()); }

  Result<void> start() {
    Result<Program> resolve = Program::build("screen.vert", "resolve.frag");
    if (!resolve) return Refusal(resolve.error());
    Result<std::unique_ptr<Stage>> stage = Stage::create();
    if (!stage) return Refusal(stage.error());
    gl_.emplace(std::move(*resolve), PictureTarget{}, VertexArray{}, std::move(*stage));
    return {};
  }

  Stage& stage() override {
    static_cast<void>(context_.make_current());
    return *gl_->stage;
  }

  Result<Image> draw(std::span<const draw::ShownCharacter> characters, const draw::Camera& camera, const Look& look,
                     int width, int height) override {
    const std::string size = std::to_string(width) + " x " + std::to_string(height) + " pixels";
    if (width < 1 || height < 1 || width > kPictureSideMax || height > kPictureSideMax)
      return Refusal("picture of " + size + ": sides must be 1 … " + std::to_string(kPictureSideMax));
    if (!context_.make_current()) return Refusal("EGL context cannot be made current");
    if (!gl_->target.resize(width, height, supersample_for(width, height)))
      return Refusal("OpenGL ES has no room for a picture of " + size);
    gl_->target.begin_large();
    // The detail of a small picture depends on its own pixels, not on the samples behind them: quality multiplies the
    // head's height, which is counted in large pixels.
    Look own = look;
    own.quality /= static_cast<float>(gl_->target.supersample());
    gl_->stage->draw(characters, camera, own, gl_->target.large_width(), gl_->target.large_height(), true, {});
    Image image = resolve();
    // Drivers report a lack of memory late, often only after drawing.
    if (glGetError() != GL_NO_ERROR) return Refusal("OpenGL ES ran out of memory or failed while drawing");
    return image;
  }

 private:
  struct Gl {
    Program resolve;
    PictureTarget target;
    // OpenGL draws the single triangle over the screen with it, which has no vertex data.
    VertexArray nothing;
    std::unique_ptr<Stage> stage;
  };

  // Limits the large picture to the size of a texture and to a reasonable amount of memory.
  [[nodiscard]] int supersample_for(int width, int height) const {
    GLint texture_max = 0, renderbuffer_max = 0;
    glGetIntegerv(GL_MAX_TEXTURE_SIZE, &texture_max);
    glGetIntegerv(GL_MAX_RENDERBUFFER_SIZE, &renderbuffer_max);
    const int side_max = std::min(texture_max, renderbuffer_max);
    int n = supersample_;
    while (n > 1 && (std::max(width, height) * n > side_max ||
                     static_cast<std::int64_t>(width) * height * n * n > kLargePixelsMax)) {
      --n;
    }
    return n;
  }

  [[nodiscard]] Image resolve() const {
    gl_->target.begin_small();
    // The depth of the large picture says nothing about this triangle over all pixels.
    glDisable(GL_DEPTH_TEST);
    glDisable(GL_BLEND);
    gl_->resolve.use();
    gl_->resolve.set("supersample", gl_->target.supersample());
    glBindVertexArray(gl_->nothing.name());
    glDrawArrays(GL_TRIANGLES, 0, 3);
    return gl_->target.read_small();
  }

  // It comes first, so that it is destroyed last.
  EglContext context_;
  int supersample_;
  std::optional<Gl> gl_;
};

}  // namespace

Result<std::unique_ptr<Renderer>> Renderer::create(int supersample) {
  if (supersample < 1 || supersample > 4) return Refusal("supersample is not in 1 … 4");
  Result<EglContext> context = EglContext::create();
  if (!context) return Refusal(context.error());
  auto renderer = std::make_unique<GlRenderer>(std::move(*context), supersample);
  if (const Result<void> started = renderer->start(); !started) return Refusal(started.error());
  return renderer;
}

}  // namespace hairnet::render
