#pragma once

#include <string>
#include <string_view>

#include "client/viewer/characters/options.hpp"
#include "core/result.hpp"

namespace hairnet::viewer {

// Parses "groom=made:long_curly,motion=made:dance,level=high,name=Ann,colour=red"; only the key groom is required. A
// later key replaces an earlier one of the same name. Values cannot contain commas. The error is one line.
Result<CharacterOptions> parse_character(const std::string& spec);

// Parses the whole of `text` as a finite number, in the C locale: a decimal point, whatever the user's language.
Result<double> parse_finite_number(std::string_view text);

}  // namespace hairnet::viewer
