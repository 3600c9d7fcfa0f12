#pragma once

#include <span>
#include <string>

#include "tests/fidelity/collisions_measure.hpp"

namespace hairnet::fidelity {

// Markdown: a row a hairstyle and level over all its ticks, then a row for each motion over all hairstyles.
std::string depth_tables(std::span<const Depths> all);

std::string depths_json(std::span<const Depths> all);

}  // namespace hairnet::fidelity
