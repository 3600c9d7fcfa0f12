#pragma once

#include <string>
#include <string_view>

#include "client/viewer/characters/options.hpp"
#include "core/result.hpp"

namespace hairnet::viewer {

// Parses "groom=made:long_curly,motion=made:dance,level=high,name=Ann,colour=red"; only the key groom is
// required.
Result<CharacterOptions> parse_character(const std::string& spec);

// Parses the whole of `text` as a finite number.
Result<double> parse_finite_number(std::string_view text);

}  // namespace hairnet::viewer
