#pragma once

#include <string>

#include "core/groom/groom.hpp"
#include "core/made/made.hpp"
#include "core/result.hpp"

namespace hairnet {

// What a command line names as a groom: a groom file's path, or `made:STYLE` with `made` as its options.
Result<Groom> load_groom(const std::string& spec, const HairstyleOptions& made = {});

}  // namespace hairnet
