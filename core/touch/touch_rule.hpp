#pragma once

#include <cstdint>
#include <vector>

#include "core/touch/touch_body.hpp"

namespace hairnet {

// Who may touch a character's hair. Each value allows all that the one before it allows.
enum class TouchAudience : std::uint8_t { nobody, oneself, chosen, everyone };

struct TouchRule {
  TouchAudience audience = TouchAudience::oneself;
  // The touchers whom TouchAudience::chosen allows, ascending. The character's owner is always allowed and need not be
  // named.
  std::vector<ToucherId> chosen = {};
  friend bool operator==(const TouchRule&, const TouchRule&) = default;
};

// Whether `toucher` may touch a character of `owner`. Props of the room touch everyone.
bool may_touch(const TouchRule& rule, ToucherId owner, ToucherId toucher);
// Whether this body of a toucher may touch a character of `owner`.
bool may_touch(const TouchRule& rule, ToucherId owner, const TouchBody& body);

}  // namespace hairnet
