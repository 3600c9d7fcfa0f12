#include "client/view/light_maps.hpp"

#include "client/view/program.hpp"

namespace hairnet::view {
namespace {

void make_texture(const Texture& texture, GLenum format, int side, GLint filter) {
  glBindTexture(GL_TEXTURE_2D, texture.name());
  glTexStorage2D(GL_TEXTURE_2D, 1, format, side, side);
  glTexParameteri(GL_TEXTURE_2D, GL_TEXTURE_MIN_FILTER, filter);
  glTexParameteri(GL_TEXTURE_2D, GL_TEXTURE_MAG_FILTER, filter);
  glTexParameteri(GL_TEXTURE_2D, GL_TEXTURE_WRAP_S, GL_CLAMP_TO_EDGE);
  glTexParameteri(GL_TEXTURE_2D, GL_TEXTURE_WRAP_T, GL_CLAMP_TO_EDGE);
}

void attach(const Framebuffer& target, GLenum attachment, const Texture& texture) {
  glBindFramebuffer(GL_FRAMEBUFFER, target.name());
  glFramebufferTexture2D(GL_FRAMEBUFFER, attachment, GL_TEXTURE_2D, texture.name(), 0);
  const GLenum colour = attachment == GL_COLOR_ATTACHMENT0 ? GL_COLOR_ATTACHMENT0 : GL_NONE;
  glDrawBuffers(1, &colour);
}

void begin_depth(const Framebuffer& target, int side) {
  glBindFramebuffer(GL_FRAMEBUFFER, target.name());
  glViewport(0, 0, side, side);
  glEnable(GL_DEPTH_TEST);
  glDisable(GL_BLEND);
  glDepthMask(GL_TRUE);
  glClearDepthf(1);
  glClear(GL_DEPTH_BUFFER_BIT);
}

}  // namespace

LightMaps::LightMaps() {
  make_texture(body_, GL_DEPTH_COMPONENT24, kBodySide, GL_LINEAR);
  glTexParameteri(GL_TEXTURE_2D, GL_TEXTURE_COMPARE_MODE, GL_COMPARE_REF_TO_TEXTURE);
  glTexParameteri(GL_TEXTURE_2D, GL_TEXTURE_COMPARE_FUNC, GL_LEQUAL);
  make_texture(first_, GL_DEPTH_COMPONENT24, kSide, GL_NEAREST);
  make_texture(layers_, GL_RGBA8, kSide, GL_LINEAR);
  attach(body_target_, GL_DEPTH_ATTACHMENT, body_);
  attach(first_target_, GL_DEPTH_ATTACHMENT, first_);
  attach(layers_target_, GL_COLOR_ATTACHMENT0, layers_);
}

void LightMaps::begin_body_depth() const {
  begin_depth(body_target_, kBodySide);
}

void LightMaps::begin_first_depth() const {
  begin_depth(first_target_, kSide);
}

void LightMaps::begin_layers() const {
  glBindFramebuffer(GL_FRAMEBUFFER, layers_target_.name());
  glViewport(0, 0, kSide, kSide);
  glDisable(GL_DEPTH_TEST);
  glEnable(GL_BLEND);
  glBlendFunc(GL_ONE, GL_ONE);
  glClearColor(0, 0, 0, 0);
  glClear(GL_COLOR_BUFFER_BIT);
  // The layers count from the first hair.
  glActiveTexture(GL_TEXTURE0 + kHairFirstDepthUnit);
  glBindTexture(GL_TEXTURE_2D, first_.name());
}

void LightMaps::bind_textures() const {
  glActiveTexture(GL_TEXTURE0 + kHairFirstDepthUnit);
  glBindTexture(GL_TEXTURE_2D, first_.name());
  glActiveTexture(GL_TEXTURE0 + kHairLayersUnit);
  glBindTexture(GL_TEXTURE_2D, layers_.name());
  glActiveTexture(GL_TEXTURE0 + kBodyDepthUnit);
  glBindTexture(GL_TEXTURE_2D, body_.name());
}

}  // namespace hairnet::view
