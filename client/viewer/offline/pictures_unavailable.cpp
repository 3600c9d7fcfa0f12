#include "client/viewer/offline/pictures.hpp"

namespace hairnet::viewer {

Result<std::unique_ptr<Pictures>> make_pictures() {
  return Refusal("this build has no renderer (HAIRNET_VIEW is off), so --out and --sheet are not possible");
}

}  // namespace hairnet::viewer
