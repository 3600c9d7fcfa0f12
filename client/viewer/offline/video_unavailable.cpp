#include "client/viewer/offline/video.hpp"

namespace hairnet::viewer {
namespace {

Refusal no_renderer() {
  return Refusal("this build has no renderer (HAIRNET_VIEW is off), so videos are not possible");
}

}  // namespace

std::vector<double> video_times_s(const ViewOptions&) {
  return {};
}

Result<void> check_video(const ViewOptions&) {
  return no_renderer();
}

Result<void> record_local_video(const ViewOptions&, const std::vector<CharacterSetup>&) {
  return no_renderer();
}

Result<void> record_stream_video(const ViewOptions&, const std::vector<CharacterSetup>&, const StreamResult&) {
  return no_renderer();
}

}  // namespace hairnet::viewer
