#pragma once

#include <map>
#include <memory>
#include <utility>
#include <vector>

#include "schema/codec/frame_codec.hpp"
#include "schema/wire/messages.hpp"

namespace hairnet::link {

// The data for decoding frames of a level. Immutable.
struct KnownLevel {
  explicit KnownLevel(LevelGeometry g) : geometry(std::move(g)), neighbours(geometry) {}
  LevelGeometry geometry;
  codec::Neighbours neighbours;
};

// The level records that all LinkCores of one thread share: cores that receive the same record share one copy.
// One thread.
class LevelCatalog {
 public:
  std::shared_ptr<const KnownLevel> keep(wire::LevelRecord record);

 private:
  std::map<std::pair<wire::GroomHash, LevelIndex>, std::weak_ptr<const KnownLevel>> levels_;
};

}  // namespace hairnet::link
