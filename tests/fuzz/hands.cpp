#include "core/touch/hand.hpp"
#include "schema/codec/hand_code.hpp"
#include "schema/limits.hpp"
#include "tests/fuzz/target.hpp"

// Any bytes are refused with one line, or give valid hands, whose bodies are valid and whose own encoding gives the
// same hands again.
int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace hairnet;
  std::vector<Hand> hands;
  if (const std::string error = codec::decode_hands({data, size}, hands); !error.empty()) {
    fuzz::require(error.find('\n') == std::string::npos, "an error of one line");
    return 0;
  }
  fuzz::require(validate(hands).empty(), "hands that are valid: " + validate(hands));
  std::vector<TouchBody> bodies;
  for (const Hand& hand : hands) append_bodies(hand, 1, bodies);
  for (const TouchBody& body : bodies) fuzz::require(validate(body).empty(), "a body that is valid: " + validate(body));
  const std::vector<std::uint8_t> encoded = codec::encode_hands(hands);
  fuzz::require(encoded.size() <= wire::kHandsBytesMax, "no more bytes than the widest hands");
  std::vector<Hand> again;
  fuzz::require(codec::decode_hands(encoded, again).empty(), "decodes again");
  fuzz::require(again.size() == hands.size(), "as many hands again");
  for (std::size_t h = 0; h < hands.size(); ++h) {
    fuzz::require(again[h].first_number == hands[h].first_number && again[h].has_jumped == hands[h].has_jumped &&
                      again[h].shapes == hands[h].shapes && again[h].place.position == hands[h].place.position,
                  "the same hand again");
    // Each encoding rounds a rotation by at most 0.25 mrad.
    const double turned_rad = again[h].place.rotation.angularDistance(hands[h].place.rotation);
    fuzz::require(turned_rad <= 5e-4, "the same rotation again, but for its rounding");
  }
  return 0;
}
