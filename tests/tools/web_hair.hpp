#pragma once

#include <nlohmann/json.hpp>

namespace hairnet {

// Results of core and link for hair, which the web client must reproduce.

// FFD in double (reference_deform) of points in and out of lattices, with tangents; both kinds.
nlohmann::ordered_json ffd_cases();
// Whole grooms: root blend, rest tangents and all points deformed (Deformer), then as drawn
// (StrandLengths).
nlohmann::ordered_json groom_cases();
// Groom files that must be refused, by name.
nlohmann::ordered_json spoilt_groom_cases();
// Points that SkinPush keeps out of a skin.
nlohmann::ordered_json skin_case();
// Root-blend curves at many ratios.
nlohmann::ordered_json root_blend_cases();
// Frames that arrive with jitter, played out (link::Playout).
nlohmann::ordered_json playout_cases();
// What is drawn of small grooms (draw::GroomGeometry) with the light that reaches it and its scalp; draw detail,
// lights, and a character's record.
nlohmann::ordered_json drawing_cases();

}  // namespace hairnet
