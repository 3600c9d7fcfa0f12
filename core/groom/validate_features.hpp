#pragma once

#include <string>

#include "core/groom/groom.hpp"

namespace hairnet {

// Parts of validate(Groom).

// Checks the properties alone; returns an empty string when valid.
std::string error_of(const StrandProperties& properties, const Groom& groom);

// Checks root blends, clumps, threads, cards, cloths and knots. The strands must be valid and their offsets ascending.
std::string validate_features(const Groom& groom, const GroomLimits& limits);

}  // namespace hairnet
