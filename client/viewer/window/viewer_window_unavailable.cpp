#include "client/viewer/window/viewer_window.hpp"

namespace hairnet::viewer {

Result<void> run_window(const ViewOptions&) {
  return Refusal("this build has no window (HAIRNET_VIEW is off); --no-draw or --trace stream without one");
}

}  // namespace hairnet::viewer
