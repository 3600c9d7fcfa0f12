#pragma once

#include <string>

#include "client/assets/made/made.hpp"
#include "core/groom/groom.hpp"
#include "core/result.hpp"

namespace hairnet {

// What a command line names as a groom: a groom file's path, or `made:STYLE` with `made` as its options. Far cards are
// made for one that has none, so that every program can draw it far away.
Result<Groom> load_groom(const std::string& spec, const HairstyleOptions& made = {});
// The same, but as it is: nothing is added.
Result<Groom> read_groom(const std::string& spec, const HairstyleOptions& made = {});

}  // namespace hairnet
