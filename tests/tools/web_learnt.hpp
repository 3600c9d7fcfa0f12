#pragma once

#include <nlohmann/json.hpp>

namespace hairnet {

// Learnt hair, which the web client must evaluate likewise. `file` of a network, the `checksum` of what it holds, and
// `spoilt` files with theirs, or null where they are refused; `frames` of one character: what a client is told, and the
// coefficients that it shows.
nlohmann::ordered_json learnt_cases();

}  // namespace hairnet
