#pragma once

#include <memory>
#include <string_view>
#include <vector>

#include "tests/load/attacker.hpp"
#include "tests/load/stage.hpp"

namespace hairnet::load {

// What each attack is, in the order of Attack.
const std::array<std::string_view, kAttackNames.size()>& attack_meanings();

// All attackers of an attack. Each person among them has a loopback address of its own, since a server's limits are
// those of a person.
std::vector<std::unique_ptr<Attacker>> make_attackers(Attack attack, const AttackContext& context);

}  // namespace hairnet::load
