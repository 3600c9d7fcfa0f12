#pragma once

#include <string>

#include "core/groom/groom.hpp"

namespace hairnet {

// Parts of validate(Groom).

// Of the properties alone; empty when sound.
std::string fault_of(const StrandProperties& properties, const Groom& groom);

// Root blends, clumps, threads, cards, cloths and knots; the strands must be sound and their offsets in order.
std::string validate_features(const Groom& groom, const GroomLimits& limits);

std::string validate_far_cards(const Groom& groom, const GroomLimits& limits);

}  // namespace hairnet
