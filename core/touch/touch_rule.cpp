#include "core/touch/touch_rule.hpp"

#include <algorithm>

namespace hairnet {

bool may_touch(const TouchRule& rule, ToucherId owner, ToucherId toucher) {
  if (toucher == kRoomToucher || rule.audience == TouchAudience::everyone) return true;
  if (rule.audience == TouchAudience::nobody) return false;
  // `chosen` ascends, as World::set_touch_rule asserts.
  return toucher == owner ||
         (rule.audience == TouchAudience::chosen && std::ranges::binary_search(rule.chosen, toucher));
}

bool may_touch(const TouchRule& rule, ToucherId owner, const TouchBody& body) {
  return (!body.only_own || body.key.toucher == owner) && may_touch(rule, owner, body.key.toucher);
}

}  // namespace hairnet
