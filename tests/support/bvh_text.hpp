#pragma once

#include <string>

#include "tests/support/deepmimic_clip.hpp"

namespace hairnet {

// Returns the clip on DeepMimic's skeleton as a BVH file: metres, y up, facing +x. Its "neck" becomes Neck, which
// turns about the top of the trunk, and Head, which is rigid with Neck at the base of the skull. DeepMimic's
// shoulders turn arms, so that they are called LeftArm and RightArm: an importer that looks for shoulder blades
// finds none and keeps them on the trunk.
std::string bvh_text(const DeepMimicClip& clip);

}  // namespace hairnet
