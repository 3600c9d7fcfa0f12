#include "client/viewer/offline/video.hpp"

namespace hairnet::viewer {
namespace {

Refusal no_renderer() {
  return Refusal("this build has no renderer (HAIRNET_VIEW is off), so clips are not possible");
}

}  // namespace

std::vector<double> film_times_s(const ViewOptions&) {
  return {};
}

Result<void> check_film(const ViewOptions&) {
  return no_renderer();
}

Result<void> film_locally(const ViewOptions&, const std::vector<Actor>&) {
  return no_renderer();
}

Result<void> film_stream(const ViewOptions&, const std::vector<Actor>&, const StreamResult&) {
  return no_renderer();
}

}  // namespace hairnet::viewer
