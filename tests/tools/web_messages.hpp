#pragma once

#include <nlohmann/json.hpp>
#include <span>

#include "core/groom/groom.hpp"
#include "schema/wire/messages.hpp"

namespace hairnet {

// As the web client's objects: camelCase names, bytes and hashes in hexadecimal, 64-bit numbers as decimal text.
nlohmann::ordered_json to_json(const wire::Message& message);
nlohmann::ordered_json to_json(const LevelGeometry& geometry);
nlohmann::ordered_json to_json(const Groom& groom);
// Rotation x y z w and position x y z of each bone.
nlohmann::ordered_json to_json(const Pose& pose);

// Each of the numbers, at the end of a list.
void append(const auto& numbers, nlohmann::ordered_json& list) {
  for (const auto number : numbers) list.push_back(number);
}

// Numbers of vectors, one after the other.
nlohmann::ordered_json flat(std::span<const Vec3f> vectors);

}  // namespace hairnet
